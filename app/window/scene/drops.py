"""What a person drops on the window, sorted: photos, folders of photos, films, scenes, the rest.

`os.path` asks the disk here, because people type paths that `Path` would raise on: too long, say.
"""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from langflash_core.formats import FILMS_IN, is_film
from langflash_core.images.pictures import FILM_PHOTOS as FILM_PHOTOS
from langflash_core.images.pictures import MAX_PHOTOS as MAX_PHOTOS
from langflash_core.outputs import DROPPED

PHOTO_SUFFIXES = frozenset(
    {".jpg", ".jpeg", ".png", ".webp", ".heic", ".heif", ".tif", ".tiff", ".bmp", ".avif"}
)
SCENE_SUFFIX = ".langflash"
SCENE_SUFFIXES = frozenset(DROPPED)
FILM_SUFFIXES = frozenset(FILMS_IN)


@dataclass(frozen=True)
class Drop:
    """Sorted paths; `rejected` holds one sentence with a remedy per path that is none of these."""

    photos: tuple[Path, ...] = ()
    films: tuple[Path, ...] = ()
    scenes: tuple[Path, ...] = ()
    rejected: tuple[str, ...] = ()


class There(Enum):
    """What the disk has at a path."""

    NOTHING = "nothing"
    FILE = "a file"
    FOLDER = "a folder"


@dataclass(frozen=True)
class Typed:
    """The path that is typed in a dialog. there: what a file written to it would find, since the disk was
    asked; that the effects do, and no panel."""

    text: str = ""
    there: There = There.NOTHING


NOT_TYPED = Typed()


def still_there(
    photos: Iterable[tuple[str, float | None]],
) -> tuple[tuple[tuple[str, float | None], ...], tuple[str, ...]]:
    """Of photos with their fields of view those that are on the disk, and the names of the others."""
    found, missing = list[tuple[str, float | None]](), list[str]()
    for path, fov in photos:
        if os.path.isfile(path):
            found.append((path, None if fov is None else float(fov)))
        else:
            missing.append(os.path.basename(path))
    return tuple(found), tuple(missing)


def typed_path(text: str) -> Path:
    """The path a person typed, with `~` spelled out; an unknown user's stays as it is."""
    return Path(os.path.expanduser(text.strip()))


def typed_scene(typed: Typed) -> Path | None:
    """Where to write the scene that a person typed a name for; None while it names no file."""
    named = typed.text.strip() and typed_path(typed.text).name
    return _with_ending(typed.text) if named and typed.there is not There.FOLDER else None


def look_up(text: str, scene: bool) -> There:
    """Ask the disk about a path that is typed, or about the file of a `scene` that is called so."""
    if os.path.isdir(typed_path(text)):
        return There.FOLDER
    wanted = _with_ending(text) if scene and typed_path(text).name else typed_path(text)
    return There.FILE if os.path.isfile(wanted) else There.NOTHING


def _with_ending(text: str) -> Path:
    path = typed_path(text)
    return path if path.suffix else path.with_suffix(SCENE_SUFFIX)


def sort_drop(paths: Iterable[str | Path]) -> Drop:
    """Sort paths by what they are; a folder stands for the photos directly in it, else for its films,
    else for its scenes."""
    photos: list[Path] = []
    films: list[Path] = []
    scenes: list[Path] = []
    rejected: list[str] = []
    for path in map(Path, paths):
        if os.path.isdir(path):
            try:
                inside = sorted(p for p in path.iterdir() if p.is_file() and not p.name.startswith("."))
            except OSError as error:
                rejected.append(f"The folder {path.name} cannot be read: {error.strerror or error}.")
                continue
            found = [p for p in inside if p.suffix.lower() in PHOTO_SUFFIXES]
            kept = [p for p in inside if p.suffix.lower() in SCENE_SUFFIXES]
            filmed = [p for p in inside if is_film(p)]
            if not found and not filmed and not kept:
                rejected.append(f"The folder {path.name} holds no photo; drop a folder of JPEG or PNG files.")
            photos += found
            films += [] if found else filmed
            scenes += [] if found or filmed else kept
        elif not os.path.exists(path):
            rejected.append(f"{path} does not exist; check the path.")
        elif path.suffix.lower() in SCENE_SUFFIXES:
            scenes.append(path)
        elif path.suffix.lower() in PHOTO_SUFFIXES:
            photos.append(path)
        elif is_film(path):
            films.append(path)
        else:
            rejected.append(
                f"{path.name} is no photo, film or scene; drop JPEG, PNG, .mp4, .langflash or .ply files."
            )
    return Drop(_each_once(photos), _each_once(films), _each_once(scenes), tuple(rejected))


def _each_once(paths: Iterable[Path]) -> tuple[Path, ...]:
    return tuple(dict.fromkeys(path.resolve() for path in paths))
