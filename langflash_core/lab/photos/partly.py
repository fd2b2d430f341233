"""Converters of photos that nobody labelled whole: things outlined in some of them, or nothing at all.

What nobody outlined is unknown, which is not the same as background: it stays 0, as in every folder.
Photos that came from one (other crops or light of it) are numbered in a row, and a number is left out
before the next, so that `split` keeps all of them or none.

Sizes: H W pixels of a photo.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path

import numpy as np
import torch
from PIL import Image, ImageDraw
from torch import Tensor

from langflash_core.base.picture_files import opened_picture
from langflash_core.errors import InputError
from langflash_core.images.decode import read_photo
from langflash_core.lab.photos.folder import PHOTO_SUFFIXES
from langflash_core.lab.photos.reading import Source, read_json
from langflash_core.lab.photos.writing import FolderWriter, NameTable

WHITE = 248
"""From which value on a border is no part of the photo."""
SMALLEST = 64
"""Pixels of a side: what is left of a photo without its border must have so many."""
PANORAMA_FOV = 75.0
"""Degrees from left to right in a view of a panorama."""
PANORAMA_SIZE = (392, 294)
PANORAMA_VIEWS = 7
"""Views of a panorama, evenly around: neighbours share 24 of their 75 degrees."""


def from_polygons(source: Source, writer: FolderWriter) -> None:
    """Outlines as YOLO has them: data.yaml with names, and in it or in train, valid, test: images/ and
    labels/STEM.txt with a line "class x y x y ..." in shares of the sides a thing.

    Smaller things lie over larger ones. Boxes (lines of five numbers) outline nothing and are left out.
    """
    table = NameTable()
    ids = [table.id(name) for name in _yaml_names(source.path / "data.yaml")]
    photos = [p for folder in _splits(source.path) for p in _photos(folder / "images")]
    for id, photo in source.walk(numbered(photos)):
        outlines = list(_yolo(photo.parent.parent / "labels" / f"{photo.stem}.txt", len(ids)))
        with opened_picture(photo) as opened:
            size = opened.size
        writer.photo(id, photo)
        shapes = [(ids[row], [points * np.array(size)]) for row, points in outlines]
        writer.labels(id, painted(size, shapes))
    writer.finish(table.names, f"outlines of {source.path.name}")


def from_things(source: Source, writer: FolderWriter) -> None:
    """COCO instances, annotations/instances_SPLIT.json; photos in ../SPLIT, or further: "images".

    Walls, floors and whatever else is no thing are unknown. Source: Lin et al., Microsoft COCO: Common
    Objects in Context, ECCV 2014.
    """
    document = read_json(source.path, ("images", "annotations", "categories"))
    split = source.path.stem.removeprefix("instances_")
    photos = source.further.get("images", source.path.parent.parent / split)
    of_photo: dict[int, list[dict]] = {}
    for annotation in document["annotations"]:
        of_photo.setdefault(annotation["image_id"], []).append(annotation)
    for image in source.walk(sorted(document["images"], key=lambda image: image["id"])):
        id, size = f"{image['id']:012d}", (image["width"], image["height"])
        writer.photo(id, photos / image["file_name"])
        shapes = [(a["category_id"], _outlined(a, source.path)) for a in of_photo.get(image["id"], [])]
        writer.labels(id, painted(size, shapes))
    names = {c["id"]: (c["name"], None) for c in document["categories"]}
    writer.finish(names, "COCO 2017 instances, annotations CC BY 4.0")


def from_plain(source: Source, writer: FolderWriter) -> None:
    """Photos without labels, in a folder and the folders in it; white bars at their sides are cut off."""
    for id, photo in source.walk(numbered(_photos(source.path))):
        pixels = np.asarray(read_photo(photo).image.convert("RGB"))
        inner = unframed(pixels)
        writer.photo(id, photo if inner.shape == pixels.shape else inner)
    writer.finish({}, f"photos of {source.path.name}")


def from_panoramas(source: Source, writer: FolderWriter) -> None:
    """Equirectangular panoramas, twice as wide as high: views all around with their lens and their poses,
    which differ by a turn about the vertical alone."""
    width, height = PANORAMA_SIZE
    focal = 0.5 * width / np.tan(np.deg2rad(0.5 * PANORAMA_FOV))
    number = 0
    for photo in source.walk(_photos(source.path)):
        sphere = np.asarray(read_photo(photo).image.convert("RGB"))
        if sphere.shape[1] != 2 * sphere.shape[0]:
            raise InputError(f"{photo} is no panorama, which is twice as wide as high; take it away")
        number += 1  # a gap, so that views of one panorama stay together
        for turn in range(PANORAMA_VIEWS):
            number += 1
            id, pose = f"{number:06d}", turned(2 * np.pi * turn / PANORAMA_VIEWS)
            writer.photo(id, panorama_view(sphere, pose, PANORAMA_SIZE, focal))
            writer.camera(id, focal, focal, width / 2, height / 2)
            writer.pose(id, pose)
    writer.finish({}, f"views of the panoramas of {source.path.name}")


def turned(angle: float) -> Tensor:
    """Camera to world (4, 4) float64 of a camera turned to the right by `angle` radians."""
    pose = torch.eye(4, dtype=torch.float64)
    c, s = float(np.cos(angle)), float(np.sin(angle))
    pose[0, 0], pose[0, 2], pose[2, 0], pose[2, 2] = c, s, -s, c
    return pose


def panorama_view(sphere: np.ndarray, pose: Tensor, size: tuple[int, int], focal: float) -> np.ndarray:
    """A pinhole view (H, W, 3) uint8 of a panorama (h, 2h, 3) uint8, by bilinear values.

    The panorama's middle column looks along +z, its rows go from straight up to straight down.
    """
    width, height = size
    x = (np.arange(width) + 0.5 - width / 2) / focal
    y = (np.arange(height) + 0.5 - height / 2) / focal
    rays = np.stack(np.broadcast_arrays(x, y[:, None], 1.0), -1) @ pose[:3, :3].numpy().T
    around = np.arctan2(rays[..., 0], rays[..., 2]) / (2 * np.pi) + 0.5
    down = np.arctan2(rays[..., 1], np.hypot(rays[..., 0], rays[..., 2])) / np.pi + 0.5
    wrapped = np.concatenate((sphere[:, -1:], sphere, sphere[:, :1]), 1).astype(np.float32)
    column, row = around * sphere.shape[1] + 0.5, (down * sphere.shape[0] - 0.5).clip(0, sphere.shape[0] - 1)
    left, top = np.floor(column).astype(int), np.floor(row).astype(int)
    right, bottom = (left + 1).clip(max=wrapped.shape[1] - 1), (top + 1).clip(max=sphere.shape[0] - 1)
    across, along = (column - left)[..., None], (row - top)[..., None]
    above = wrapped[top, left] * (1 - across) + wrapped[top, right] * across
    below = wrapped[bottom, left] * (1 - across) + wrapped[bottom, right] * across
    return (above * (1 - along) + below * along).round().astype(np.uint8)


def painted(size: tuple[int, int], shapes: Iterable[tuple[int, list[np.ndarray]]]) -> np.ndarray:
    """Ids (H, W) int64 of outlined things, the larger ones first, so that smaller ones lie over them.

    Args:
        size: (width, height). shapes: an id and its outlines, points (n, 2) in pixels, or one mask (H, W).
    """
    width, height = size
    masks = [(id, _filled(size, outlines)) for id, outlines in shapes]
    ids = np.zeros((height, width), dtype=np.int64)
    for id, mask in sorted(masks, key=lambda item: -int(item[1].sum())):
        ids[mask] = id
    return ids


def _filled(size: tuple[int, int], outlines: Sequence[np.ndarray]) -> np.ndarray:
    """(H, W) bool."""
    if len(outlines) == 1 and outlines[0].dtype == np.bool_:
        return outlines[0]
    canvas = Image.new("1", size)
    draw = ImageDraw.Draw(canvas)
    for points in outlines:
        draw.polygon([(float(x), float(y)) for x, y in points], fill=1)
    return np.asarray(canvas)


def _outlined(annotation: dict, path: Path) -> list[np.ndarray]:
    """Outlines of one COCO annotation, or its mask where it is counted in runs of pixels."""
    shape = annotation["segmentation"]
    if isinstance(shape, list):
        return [np.array(points, dtype=np.float64).reshape(-1, 2) for points in shape if len(points) >= 6]
    counts, (height, width) = shape["counts"], shape["size"]
    if not isinstance(counts, list) or sum(counts) != height * width:
        raise InputError(f"{path} holds a mask that is not counted in runs; use instances as published")
    values = np.arange(len(counts)) % 2 == 1
    return [np.repeat(values, counts).reshape(width, height).T]


def unframed(pixels: np.ndarray) -> np.ndarray:
    """The picture (H, W, 3) without rows and columns at its sides that are white; all of it where too
    little would be left."""
    inside = pixels.min(-1) < WHITE
    rows, columns = inside.mean(1) > 0.02, inside.mean(0) > 0.02
    if not rows.any() or not columns.any():
        return pixels
    top, bottom = int(rows.argmax()), len(rows) - int(rows[::-1].argmax())
    left, right = int(columns.argmax()), len(columns) - int(columns[::-1].argmax())
    small = min(bottom - top, right - left) < SMALLEST
    return pixels if small else np.ascontiguousarray(pixels[top:bottom, left:right])


def numbered(photos: Sequence[Path]) -> list[tuple[str, Path]]:
    """Photos with numbers as ids; those that came from one in a row, and a gap before the next."""
    found, number = [], 0
    for _, group in groupby(sorted(photos, key=_origin), key=_origin):
        number += 1
        for photo in group:
            number += 1
            found.append((f"{number:06d}", photo))
    return found


def _origin(photo: Path) -> tuple[str, str]:
    """The photo that a file came from, as exports of augmented sets name it: STEM_jpg.rf.HASH.jpg."""
    return re.sub(r"(_(jpg|jpeg|png))?\.rf\..*$", "", photo.stem), str(photo.parent.parent)


def _photos(folder: Path) -> list[Path]:
    """Every photo in a folder and the folders in it, by name."""
    return sorted(p for p in folder.rglob("*") if p.suffix.lower() in PHOTO_SUFFIXES)


def _splits(path: Path) -> list[Path]:
    """Folders that hold images/ and labels/."""
    places = [path, *(path / split for split in ("train", "valid", "val", "test"))]
    return [place for place in places if (place / "images").is_dir() and (place / "labels").is_dir()]


def _yaml_names(path: Path) -> list[str]:
    """The list "names" of a data.yaml, in a line or a line each."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read ({error}); give the folder as unpacked") from None
    inline = re.search(r"^names:\s*\[(.*?)\]", text, re.MULTILINE | re.DOTALL)
    if inline:
        listed = inline[1].split(",")
    else:
        block = re.search(r"^names:\s*\n((?:\s*(?:-|\d+:)\s*.+\n?)+)", text, re.MULTILINE)
        listed = re.sub(r"^\s*(-|\d+:)\s*", "", block[1], flags=re.MULTILINE).splitlines() if block else []
    names = [name.strip().strip("'\"") for name in listed]
    if not any(names):
        raise InputError(f"{path} lists no names; give the folder as unpacked")
    return names


def _yolo(path: Path, classes: int) -> Iterator[tuple[int, np.ndarray]]:
    """Class and points (n, 2) in shares of the sides of every outline of a file; none where it is missing."""
    if not path.is_file():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        try:
            row, values = int(words[0]), np.array(words[1:], dtype=np.float64)
        except (ValueError, IndexError):
            raise InputError(f"{path} has a line that is no outline: {line[:60]!r}; correct it") from None
        if not 0 <= row < classes:
            raise InputError(f"{path} names class {row}, data.yaml has {classes}; use files of one release")
        if len(values) >= 6 and len(values) % 2 == 0 and np.isfinite(values).all():
            yield row, values.reshape(-1, 2).clip(0, 1)
