"""Converters: published layouts of labelled photos to the folder that `folder` reads.

Each takes what one downloads, as it was unpacked, and says which photos it leaves out. Nothing of a data
set comes with this project; who converts one keeps to its terms.
"""

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from langflash_core.base.picture_files import opened_picture
from langflash_core.errors import InputError
from langflash_core.lab.photos.matlab import open_mat
from langflash_core.lab.photos.partly import from_panoramas, from_plain, from_polygons, from_things
from langflash_core.lab.photos.published import (
    KINECT_CAMERA,
    NYU_CAMERA,
    NYU_FRAME,
    forty_classes,
    open_frames,
)
from langflash_core.lab.photos.reading import Source, read_json
from langflash_core.lab.photos.writing import FolderWriter, NameTable


def convert(layout: str, source: Source, out: Path) -> int:
    """Write a folder of labelled photos; returns how many there are.

    Raises:
        InputError: an unknown layout, or the source is not of that layout. OutputError: `out` cannot be
            written.
    """
    if layout not in LAYOUTS:
        raise InputError(f"there is no layout '{layout}'; choose one of {', '.join(LAYOUTS)}")
    writer = FolderWriter(out)
    LAYOUTS[layout](source, writer)
    if writer.count == 0:
        raise InputError(
            f"{source.path} holds no photo in the layout '{layout}'; give the folder as unpacked"
        )
    return writer.count


def from_nyu(source: Source, writer: FolderWriter) -> None:
    """NYU Depth v2, nyu_depth_v2_labeled.mat; further: "splits" (splits.mat: only the training split)
    and "classes" (classMapping40.mat: the forty classes of every name).

    Source: Silberman, Hoiem, Kohli, Fergus, Indoor Segmentation and Support Inference, ECCV 2012.
    """
    mat = open_mat(source.path)
    chosen: Iterable[int] = range(mat.count("images"))
    if "splits" in source.further:
        numbers = open_mat(source.further["splits"]).array("trainNdxs").ravel()
        chosen = sorted(int(n) - 1 for n in numbers)
    for index in source.walk(chosen):
        id = f"{index + 1:04d}"
        writer.photo(id, mat.item("images", index))
        writer.labels(id, mat.item("labels", index))
        writer.depths(id, mat.item("depths", index))
        writer.camera(id, *NYU_CAMERA)
    names = mat.texts("names")
    labels = forty_classes(source.further.get("classes"), len(names))
    table = {i + 1: (name, label) for i, (name, label) in enumerate(zip(names, labels, strict=True))}
    writer.finish(table, "NYU Depth v2, Silberman et al. 2012", crop=list(NYU_FRAME))


def from_coco(source: Source, writer: FolderWriter) -> None:
    """COCO panoptic, annotations/panoptic_SPLIT.json with its folder of .png beside; photos in ../SPLIT,
    or further: "images".

    Source: Kirillov, He, Girshick, Rother, Dollár, Panoptic Segmentation, CVPR 2019.
    """
    document = read_json(source.path, ("images", "annotations", "categories"))
    pngs = source.path.with_suffix("")
    split = source.path.stem.removeprefix("panoptic_")
    photos = source.further.get("images", source.path.parent.parent / split)
    files = {image["id"]: image["file_name"] for image in document["images"]}
    for annotation in source.walk(sorted(document["annotations"], key=lambda a: a["image_id"])):
        number = annotation["image_id"]
        if number not in files:
            raise InputError(
                f"{source.path} labels photo {number}, which it does not list; download it again"
            )
        id = f"{number:012d}"
        writer.photo(id, photos / files[number])
        segments = {s["id"]: s["category_id"] for s in annotation["segments_info"]}
        writer.labels(id, _panoptic(pngs / annotation["file_name"], segments))
    table = {c["id"]: (c["name"], None) for c in document["categories"]}
    writer.finish(table, "COCO 2017 panoptic, annotations CC BY 4.0")


def _panoptic(path: Path, segments: dict[int, int]) -> np.ndarray:
    """Category (H, W) of a panoptic .png, whose colours are segment numbers R + 256 G + 65536 B."""
    colours = _picture(path, "RGB").astype(np.int64)
    numbers = colours[..., 0] + 256 * colours[..., 1] + 65536 * colours[..., 2]
    known = np.array(sorted(segments), dtype=np.int64)
    categories = np.array([segments[s] for s in sorted(segments)], dtype=np.int64)
    if len(known) == 0:
        return np.zeros(numbers.shape, dtype=np.int64)
    places = np.searchsorted(known, numbers).clip(max=len(known) - 1)
    return np.where(known[places] == numbers, categories[places], 0)


def from_ade(source: Source, writer: FolderWriter) -> None:
    """ADE20K as the scene parsing benchmark has it (ADEChallengeData2016): images/training,
    annotations/training, objectInfo150.txt; the validation split is left out.

    Source: Zhou et al., Scene Parsing through ADE20K Dataset, CVPR 2017.
    """
    table = source.path / "objectInfo150.txt"
    if not table.is_file():
        raise InputError(f"there is no {table}; give the folder ADEChallengeData2016 as unpacked")
    rows = [line.split("\t") for line in table.read_text(encoding="utf-8").splitlines()[1:] if line.strip()]
    for photo in source.walk(sorted((source.path / "images" / "training").glob("*.jpg"))):
        id = photo.stem.removeprefix("ADE_train_")
        writer.photo(id, photo)
        writer.labels(id, _picture(source.path / "annotations" / "training" / f"{photo.stem}.png", "L"))
    writer.finish({int(row[0]): (row[-1], None) for row in rows}, "ADE20K, Zhou et al. 2017")


def from_sun(source: Source, writer: FolderWriter) -> None:
    """SUN RGB-D, the folder SUNRGBD as unpacked: every folder with seg.mat, image/, depth_bfx/ (or depth/)
    and intrinsics.txt. kv1/NYUdata is left out: these are NYU Depth v2's photos, its test split too.

    Depths are stored with their bits turned by three places. Source: Song, Lichtenberg, Xiao, SUN RGB-D,
    CVPR 2015.
    """
    names = NameTable()
    found = sorted(p.parent for p in source.path.rglob("seg.mat") if "NYUdata" not in p.parts)
    for number, folder in enumerate(source.walk(found), start=1):
        id = f"{number:05d}"
        pictures = sorted((folder / "image").glob("*.jpg"))
        if not pictures:
            raise InputError(f"{folder} has no image/*.jpg; unpack the data set again")
        writer.photo(id, pictures[0])
        writer.labels(id, _sun_labels(folder / "seg.mat", names))
        depth = next(
            (d for kind in ("depth_bfx", "depth") for d in sorted((folder / kind).glob("*.png"))), None
        )
        if depth is not None:
            writer.depths(id, _sun_depths(depth))
        values = _numbers(folder / "intrinsics.txt", 9)
        writer.camera(id, values[0], values[4], values[2], values[5])
    writer.finish(names.names, "SUN RGB-D, Song et al. 2015")


def _sun_labels(path: Path, table: NameTable) -> np.ndarray:
    """Ids (H, W) by `table` of a seg.mat, whose numbers are places in its own list of names."""
    mat = open_mat(path)
    own = np.array([0, *(table.id(name) for name in mat.texts("names"))], dtype=np.int64)
    places = mat.array("seglabel").astype(np.int64)
    return own[np.where(places < len(own), places, 0)]


def _sun_depths(path: Path) -> np.ndarray:
    """Metres (H, W)."""
    with opened_picture(path) as opened:
        steps = np.asarray(opened).astype(np.uint16)
    return ((steps >> 3) | (steps << 13)).astype(np.float32) / 1000


def from_frames(source: Source, writer: FolderWriter) -> None:
    """Posed RGB-D frames as 7-Scenes has them: frame-N.color.png, frame-N.depth.png (mm, 65535 = none),
    frame-N.pose.txt (camera to world); further: "camera" (K, 9 numbers; default: the Kinect of 7-Scenes).

    Frames whose pose is not finite are left out. Source: Shotton et al., Scene Coordinate Regression
    Forests, CVPR 2013.
    """
    camera = KINECT_CAMERA
    if "camera" in source.further:
        values = _numbers(source.further["camera"], 9)
        camera = (values[0], values[4], values[2], values[5])
    folder = open_frames(source.path)
    for id in source.walk(folder.ids):
        writer.photo(id, folder.colour(id))
        depths = folder.stored_depths(id)
        if depths is not None:
            writer.depths(id, depths[0])
        writer.camera(id, *camera)
        writer.pose(id, (folder.poses or {})[id])
    writer.finish({}, f"posed frames of {source.path.name}")


LAYOUTS: dict[str, Callable[[Source, FolderWriter], None]] = {
    "nyu": from_nyu,
    "coco": from_coco,
    "ade20k": from_ade,
    "sunrgbd": from_sun,
    "frames": from_frames,
    "coco-things": from_things,
    "polygons": from_polygons,
    "plain": from_plain,
    "panoramas": from_panoramas,
}


def _picture(path: Path, mode: str) -> np.ndarray:
    """(H, W) or (H, W, 3) uint8."""
    try:
        with opened_picture(path) as opened:
            same = opened.mode == mode or (mode == "L" and opened.mode == "P")
            return np.asarray(opened if same else opened.convert(mode))
    except (OSError, SyntaxError) as error:
        raise InputError(
            f"the label map {path} cannot be read ({error}); unpack the data set again"
        ) from None


def _numbers(path: Path, count: int) -> list[float]:
    """The first `count` numbers of a text file."""
    try:
        values = [float(word) for word in path.read_text(encoding="utf-8").split()]
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read ({error}); unpack the data set again") from None
    if len(values) < count:
        raise InputError(f"{path} holds {len(values)} numbers instead of {count}; unpack the data set again")
    return values[:count]
