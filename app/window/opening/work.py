"""The worker's side of opening: folders read, photos made small, films looked through, pictures taken from
the clipboard."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageGrab

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.errors import Cancelled, ImageError, LangFlashError

from ...places import state_folder
from ..commands import Command, ShowPicture
from ..requests import Asked, Job, Task
from ..scene.commands import OpenPaths
from ..scene.drops import in_folder, sayable
from ..scene.samples import pairs
from .commands import FilmRead, FolderRead, MorePictures
from .state import MOST_FILES, Folder, sample, small

SIDE = 160  # pixels of a small picture's longer side
_TILE_SIDE = 240
_AT_ONCE = 3
_KEPT = 20  # pasted pictures
_NOTHING = "The clipboard holds no photo; copy a picture, files or a path first."


@dataclass(frozen=True)
class LookThrough(Job):
    """Find the frames of a film that a scene may be made of."""

    path: Path

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> FilmRead:
        from langflash_core.images.frames import strip_of

        def check() -> None:
            if cancelled():
                raise Cancelled("the film was not read to its end")

        return FilmRead(self.path, strip_of(self.path, progress=progress, check=check))


@dataclass(frozen=True)
class ReadFolder(Task):
    """List a folder."""

    path: Path

    newest_counts = True
    light = True

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield FolderRead(listed(self.path))


@dataclass(frozen=True)
class SmallPictures(Task):
    """Some of a folder's photos as small pictures, the rest as a task of its own, so that others come in
    between; those that cannot be read are left out."""

    folder: Path
    paths: tuple[Path, ...]

    light = True

    def run(self, stopping: Asked) -> Iterator[Command]:
        for path in self.paths[:_AT_ONCE]:
            with suppress(OSError, ValueError, ImageError):
                yield ShowPicture(small(path), _small(path))
        if self.paths[_AT_ONCE:]:
            yield MorePictures(self.folder, self.paths[_AT_ONCE:])


@dataclass(frozen=True)
class SampleTiles(Task):
    """The first photo of each pair that comes with the program."""

    light = True

    def run(self, stopping: Asked) -> Iterator[Command]:
        for place, (_, (left, _)) in enumerate(pairs()):
            with suppress(OSError, ValueError, ImageError):
                yield ShowPicture(sample(place), _small(left, _TILE_SIDE))


@dataclass(frozen=True)
class PastePicture(Task):
    """Take a picture, or files, from the clipboard."""

    def run(self, stopping: Asked) -> Iterator[Command]:
        try:
            found = ImageGrab.grabclipboard()
        except (OSError, NotImplementedError, ChildProcessError) as error:
            raise LangFlashError(f"{_NOTHING[:-1]}; pictures need xclip or wl-clipboard here.") from error
        if isinstance(found, list) and found:
            yield OpenPaths(tuple(map(str, found)))
        elif isinstance(found, Image.Image):
            yield OpenPaths((str(_kept(found)),))
        else:
            raise LangFlashError(_NOTHING)


def _kept(picture: Image.Image) -> Path:
    """The picture as a file, since a scene may be made of it again; the oldest ones go."""
    import io

    folder = state_folder() / "pasted"
    make_folder(folder)
    for old in sorted(folder.glob("*.png"))[: -_KEPT + 1]:
        with suppress(OSError):
            old.unlink()
    stream = io.BytesIO()
    picture.convert("RGB").save(stream, "PNG")
    path = folder / f"pasted_{time.time_ns()}.png"
    write_atomically(path, stream.getvalue())
    return path


def listed(path: Path) -> Folder:
    """A folder's folders, photos, films and scenes, hidden ones left out."""
    try:
        with os.scandir(path) as found:
            entries = [(entry.name, entry.is_dir()) for entry in found if not entry.name.startswith(".")]
        unsaid = [name for name, _ in entries if not sayable(name)]
    except OSError as error:
        return Folder(path, problem=f"This folder cannot be read: {error.strerror or error}.")
    names = sorted((entry for entry in entries if sayable(entry[0])), key=lambda entry: entry[0].lower())
    found = in_folder(path / name for name, folder in names if not folder)
    folders = tuple(path / name for name, folder in names if folder)
    kinds = (folders, found.photos, found.films, found.scenes)
    left_out = sum(max(len(some) - MOST_FILES, 0) for some in kinds)
    return Folder(path, *(some[:MOST_FILES] for some in kinds), left_out=left_out, unsaid=len(unsaid))


def _small(path: Path, side: int = SIDE) -> np.ndarray:
    """(h, w, 3) uint8, upright."""
    from langflash_core.images.decode import read_photo

    photo = read_photo(path).image.copy()
    photo.thumbnail((side, side))
    return np.asarray(photo.convert("RGB"))
