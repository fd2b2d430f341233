"""The pairs of photos that come with the program, and where files about photos go."""

import re
from collections.abc import Sequence
from functools import cache
from itertools import takewhile
from pathlib import Path

from langflash_core.base.resources import asset_path, home_folder
from langflash_core.images.still_names import film_of

from ...places import state_folder
from .drops import SCENE_SUFFIX
from .state import Photo

_PIECES = re.compile(r"[^\W\d_]+|\d+|[\W_]+")  # of a name: words, numbers, what is between

_NAMES = ("living_room", "desk", "toy", "aloe", "books")


@cache
def pairs() -> tuple[tuple[str, tuple[Path, Path]], ...]:
    """(what it shows, left and right photo) of each; looked for once, since the empty window draws them."""
    folder = asset_path("photos")
    found = []
    for name in _NAMES:
        sides = [sorted(folder.glob(f"{name}_{side}.*")) for side in ("left", "right")]
        if all(sides):
            found.append((name.replace("_", " ").capitalize(), (sides[0][0], sides[1][0])))
    return tuple(found)


def beside(photos: Sequence[Photo]) -> Path:
    """Where a scene of these photos is proposed to go: into their folder, called by the words that their
    names begin with, as their film is, or else as the folder is. At home where that folder is not the
    person's: it came with the program, or the program fills and empties it."""
    if not photos:
        return Path.home() / f"scene{SCENE_SUFFIX}"
    folder = photos[0].path.parent
    name = _words_of([photo.path for photo in photos]) or ("" if is_ours(folder) else folder.name) or "scene"
    return (Path.home() if is_ours(folder) else folder) / f"{name}{SCENE_SUFFIX}"


def is_ours(folder: Path) -> bool:
    """Whether a folder is the program's own, and no place for a person's files."""
    return any(folder.is_relative_to(own) for own in (asset_path("photos"), home_folder(), state_folder()))


def _words_of(paths: Sequence[Path]) -> str:
    """The words that all names begin with ("living_room" of its left and right), or the film that all are of;
    "" where a camera named them ("IMG_0001", "0000")."""
    stems = [Path(film_of(path.name) or path.name).stem for path in paths]
    if len(set(stems)) == 1:
        return stems[0]
    pieces = zip(*map(_PIECES.findall, stems), strict=False)
    common = "".join(each[0] for each in takewhile(lambda each: len(set(each)) == 1, pieces))
    common = common.rstrip("0123456789 _-.(")
    return "" if common.isupper() else common
