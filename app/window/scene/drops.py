"""What a person drops on the window, sorted: photos, folders of photos, films, scenes, the rest.

`os.path` asks the disk here, because people type paths that `Path` would raise on: too long, say.
"""

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from langflash_core.base.formats import SOG_FOLDER, is_film, is_photo, kind_of
from langflash_core.base.outputs import DROPPED, SCENES_IN
from langflash_core.base.picture_files import is_picture

SCENE_SUFFIX = ".langflash"
SCENE_SUFFIXES = frozenset(DROPPED)
_LARGEST_META = 1_000_000  # bytes; a SOG's has three books of 256 numbers
_TOLD = 2  # of the messages that are shown at once


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


def typed_path(text: str, folder: Path | None = None) -> Path:
    """The path a person typed, with `~` spelled out; an unknown user's stays as it is. A name alone is of the
    `folder` on show."""
    return (folder or Path()) / os.path.expanduser(text.strip())


def typed_scene(typed: Typed) -> Path | None:
    """Where to write the scene that a person typed a name for; None while it names no file."""
    named = typed.text.strip() and typed_path(typed.text).name
    return _with_ending(typed.text) if named and typed.there is not There.FOLDER else None


def look_up(text: str, scene: bool, folder: Path | None = None) -> There:
    """Ask the disk about a path that is typed while a `folder` is on show, or about the file of a `scene`
    that is called so."""
    path = typed_path(text, folder)
    if os.path.isdir(path):
        return There.FOLDER
    wanted = _with_ending(text) if scene and path.name else path
    return There.FILE if os.path.isfile(wanted) else There.NOTHING


def typed_folder(text: str) -> Path | None:
    """The folder that a path leads to, or that its last name would be in; None while it leads to none, and of
    a name alone."""
    path = typed_path(text)
    if not path.is_absolute():
        return None
    return next((folder for folder in (path, path.parent) if os.path.isdir(folder)), None)


def _with_ending(text: str) -> Path:
    path = typed_path(text)
    return path if path.suffix else path.with_suffix(SCENE_SUFFIX)


def sayable(name: str) -> bool:
    """Whether a name is text; one of bytes that are no UTF-8 cannot be drawn."""
    return not any("\ud800" <= letter <= "\udfff" for letter in name)


def in_folder(files: Iterable[Path]) -> Drop:
    """Of the files of one folder photos, films and scenes, by their names, in order. The pictures of a SOG
    are parts of one scene, its meta.json."""
    files = tuple(files)
    parts = _sog_parts(files)
    others = [file for file in files if file not in parts]
    photos, films = tuple(filter(is_photo, others)), tuple(filter(is_film, others))
    whole = [file for file in parts if file.name == SOG_FOLDER]
    return Drop(photos, films, (*whole, *(file for file in others if file.suffix.lower() in SCENE_SUFFIXES)))


def _sog_parts(files: Sequence[Path]) -> frozenset[Path]:
    """The meta.json of a SOG in a folder and the pictures that it names; nothing where there is none."""
    meta = next((file for file in files if file.name == SOG_FOLDER), None)
    try:
        if meta is None or meta.stat().st_size > _LARGEST_META:
            return frozenset()
        parts = [part for part in json.loads(meta.read_bytes()).values() if isinstance(part, dict)]
        named = {str(name) for part in parts for name in part.get("files", ())}
    except (OSError, ValueError, RecursionError, AttributeError, TypeError):
        return frozenset()
    return frozenset(file for file in files if file.name in named or (named and file is meta))


def sort_drop(paths: Iterable[str | Path]) -> Drop:
    """Sort paths by what they are; a folder stands for the photos directly in it, else for its films,
    else for its scenes. A file with a name that says nothing is a photo where it begins as one."""
    found = [_sorted(path) for path in map(Path, paths)]
    return Drop(
        photos=_each_once(path for drop in found for path in drop.photos),
        films=_each_once(path for drop in found for path in drop.films),
        scenes=_each_once(path for drop in found for path in drop.scenes),
        rejected=tuple(sentence for drop in found for sentence in drop.rejected),
    )


def _sorted(path: Path) -> Drop:
    told = os.fsencode(path).decode(errors="replace")
    if not os.path.exists(path):
        return Drop(rejected=(f"{told} does not exist; check the path.",))
    if not sayable(os.path.realpath(path)):
        return Drop(rejected=(f"The name of {told} is not UTF-8; rename it.",))
    if os.path.isdir(path):
        return _folder(path)
    if kind_of(path) in SCENES_IN or path.suffix.lower() in SCENE_SUFFIXES:
        return Drop(scenes=(path,))
    if is_film(path):
        return Drop(films=(path,))
    if is_photo(path) or is_picture(path):
        return Drop(photos=(path,))
    remedy = "drop JPEG, PNG, .mp4, .langflash or .ply files"
    return Drop(rejected=(f"{path.name} is no photo, film or scene; {remedy}.",))


def _folder(path: Path) -> Drop:
    """Its photos, else its films, else its scenes."""
    try:
        inside = sorted(p for p in path.iterdir() if p.is_file() and not p.name.startswith("."))
    except OSError as error:
        return Drop(rejected=(f"The folder {path.name} cannot be read: {error.strerror or error}.",))
    unsaid = sum(not sayable(p.name) for p in inside)
    told = (f"{unsaid} files in {path.name} have names that are not UTF-8; rename them.",) if unsaid else ()
    found = in_folder(p for p in inside if sayable(p.name))
    if found.photos:
        return Drop(photos=found.photos, rejected=told)
    if found.films:
        return Drop(films=found.films, rejected=told)
    if found.scenes or told:
        return Drop(scenes=found.scenes, rejected=told)
    remedy = "drop a folder of JPEG or PNG files"
    return Drop(rejected=(f"The folder {path.name} holds no photo; {remedy}.",))


def told_few(sentences: tuple[str, ...]) -> tuple[str, ...]:
    """What fits on the screen: the first ones, and how many more there are."""
    shown, more = sentences[:_TOLD], len(sentences) - _TOLD
    return (*shown, f"{more} more could not be opened, for similar reasons.") if more > 0 else shown


def _each_once(paths: Iterable[Path]) -> tuple[Path, ...]:
    return tuple(dict.fromkeys(path.resolve() for path in paths))
