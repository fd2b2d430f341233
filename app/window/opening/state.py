"""What opening adds to the state: the folder that is looked at, and what is chosen there."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

LOOKING = ("open", "merge", "place")  # dialogs that show a folder
MOST_FILES = 300  # of a folder that are shown


@dataclass(frozen=True)
class Folder:
    """What lies in a folder, by name. left_out: photos and scenes beyond `MOST_FILES`. problem: a sentence
    where it cannot be read."""

    path: Path
    folders: tuple[Path, ...] = ()
    photos: tuple[Path, ...] = ()
    scenes: tuple[Path, ...] = ()
    left_out: int = 0
    problem: str = ""


@dataclass(frozen=True)
class Opening:
    """The opening half of the state. folder: None while it is read. chosen: in the order of the clicks.
    asker: the dialog that wants a folder for its file. name: of that file. pending: commands that wait for
    that dialog."""

    folder: Folder | None = None
    chosen: tuple[Path, ...] = ()
    asker: str = ""
    name: str = ""
    pending: tuple[Any, ...] = ()


NO_OPENING = Opening()


def small(path: Path) -> str:
    """What the small picture of a photo in a folder is called."""
    return f"in folder {path}"


def sample(place: int) -> str:
    """What the small picture of a pair of sample photos is called."""
    return f"sample {place}"
