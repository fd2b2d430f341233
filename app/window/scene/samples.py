"""The pairs of photos that come with the program."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from langflash_core.base.resources import asset_path

from .state import Photo

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
    """The path whose folder and stem files about these photos take: the first photo's; at home where there is
    none, or where it came with the program, whose own folder is not the person's."""
    if not photos:
        return Path.home() / "scene"
    first = photos[0].path
    return Path.home() / first.name if first.parent == asset_path("photos") else first
