"""The pairs of photos that come with the program."""

from pathlib import Path

from langflash_core.resources import asset_path

_NAMES = ("living_room", "desk", "toy", "aloe", "books")


def pairs() -> list[tuple[str, tuple[Path, Path]]]:
    """(what it shows, left and right photo) of each."""
    folder = asset_path("photos")
    found = []
    for name in _NAMES:
        sides = [sorted(folder.glob(f"{name}_{side}.*")) for side in ("left", "right")]
        if all(sides):
            found.append((name.replace("_", " ").capitalize(), (sides[0][0], sides[1][0])))
    return found
