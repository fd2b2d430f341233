"""Clips: frames in order, read one by one, with cameras where they are known.

A clip is a folder of pictures in order of their names (or numbers), a posed folder as `lab.photos` reads it
(`images/` beside `K.txt`, `poses.txt`), or one video of RealEstate10K in pixelSplat's chunks. T frames.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from langflash_core.batch.sets import check_name
from langflash_core.errors import InputError
from langflash_core.images.decode import read_photo
from langflash_core.lab.photos import PhotoFolder, open_folder
from langflash_core.lab.photos.folder import PHOTO_SUFFIXES, order
from langflash_core.lab.photos.published import re10k_scenes
from langflash_core.lab.photos.reading import read_table

INDEX = "index.json"
"""What a split of RealEstate10K in chunks has: key -> chunk."""
_HELD = 3  # frames


@dataclass(frozen=True)
class Clip:
    """One clip. ids: of the frames, T of them; read: pixels (H, W, 3) uint8 of one; Ks (T, 3, 3) pixels and
    viewmats (T, 4, 4), world to camera, or None where they are not known."""

    name: str
    ids: tuple[str, ...]
    read: Callable[[int], UInt8[np.ndarray, "H W 3"]]
    Ks: Float[Tensor, "T 3 3"] | None = None
    viewmats: Float[Tensor, "T 4 4"] | None = None

    def __len__(self) -> int:
        return len(self.ids)

    def held(self) -> "Clip":
        """The same clip, its last frames kept in memory: who asks for one again gets the very same array."""
        return replace(self, read=lru_cache(_HELD)(self.read))

    def part(self, start: int, count: int | None, step: int) -> "Clip":
        """Some of the frames: from one on, so many, every so manyth."""
        chosen = list(range(start, len(self), step))[:count]
        if not chosen:
            raise InputError(f"{self.name} has {len(self)} frames, none from {start} on; check --start")
        return replace(
            self,
            ids=tuple(self.ids[t] for t in chosen),
            read=lambda t: self.read(chosen[t]),
            Ks=None if self.Ks is None else self.Ks[chosen],
            viewmats=None if self.viewmats is None else self.viewmats[chosen],
        )


@dataclass(frozen=True)
class ClipPlace:
    """Where a clip lies: its name (that of its output), its folder or chunk, the files it is made of, and its
    key in the chunk ("" for a folder)."""

    name: str
    path: Path
    files: tuple[Path, ...]
    key: str = ""


def find_clips(source: Path) -> list[ClipPlace]:
    """The clips at a path: one folder of frames, a folder of such folders, or a split of RealEstate10K.

    Raises:
        InputError: there is none, or the name of one cannot be that of its output.
    """
    if not source.is_dir():
        raise InputError(f"there is no folder {source}; give a clip's folder of frames, or one of clips")
    if (source / INDEX).is_file():
        chunks = read_table(source / INDEX)
        for key in chunks:
            check_name(key, str(source / INDEX))
        return [ClipPlace(key, source, (source / str(chunk),), key) for key, chunk in chunks.items()]
    if _frames(source):
        return [_place(source)]
    places = [_place(folder) for folder in sorted(source.iterdir()) if folder.is_dir() and _frames(folder)]
    if not places:
        raise InputError(f"{source} holds no frames (.jpg, .png) and no folders of frames; check the path")
    return places


def open_clip(place: ClipPlace) -> Clip:
    """Open one; frames are read later.

    Raises:
        InputError: it is gone or cannot be read.
    """
    if place.key:
        folder = next((scene for _, scene in re10k_scenes(place.path, {place.key: None})), None)
        if folder is None:
            raise InputError(f"there is no video {place.key} in {place.path}; get the data set again")
        return _of_folder(place.name, folder)
    if (place.path / "images").is_dir():
        return _of_folder(place.name, open_folder(place.path))
    files = _frames(place.path)
    return Clip(place.name, tuple(path.stem for path in files), lambda t: _pixels(files[t]))


def _of_folder(name: str, folder: PhotoFolder) -> Clip:
    Ks, poses = folder.Ks, folder.poses
    posed = poses is not None and all(id in poses for id in folder.ids)
    return Clip(
        name,
        folder.ids,
        lambda t: folder.photo(folder.ids[t]).image,
        None if Ks is None else torch.stack([Ks[id] for id in folder.ids]),
        torch.stack([torch.linalg.inv(poses[id]) for id in folder.ids]).float()
        if posed and poses is not None
        else None,
    )


def _place(folder: Path) -> ClipPlace:
    return ClipPlace(folder.resolve().name, folder, tuple(_frames(folder)))


def _frames(folder: Path) -> list[Path]:
    """Of `folder/images` or of the folder itself, in order."""
    inner = folder / "images" if (folder / "images").is_dir() else folder
    found: Iterator[Path] = (path for path in inner.iterdir() if path.suffix.lower() in PHOTO_SUFFIXES)
    return sorted((path for path in found if path.is_file()), key=lambda path: order(path.stem))


def _pixels(path: Path) -> UInt8[np.ndarray, "H W 3"]:
    return np.asarray(read_photo(path).image.convert("RGB"))
