"""What opening adds to the state: the folder that is looked at, and what is chosen there; a film's strip."""

from dataclasses import dataclass
from pathlib import Path

from langflash_core.images.strip import REASONS, Strip

from ..dialogs import Dialog
from ..protocol import Command

MOST_FILES = 300  # of a folder that are shown


@dataclass(frozen=True)
class Folder:
    """What lies in a folder, by name. left_out: folders and files beyond `MOST_FILES` of a kind. unsaid:
    entries whose names are no text. problem: a sentence where it cannot be read."""

    path: Path
    folders: tuple[Path, ...] = ()
    photos: tuple[Path, ...] = ()
    films: tuple[Path, ...] = ()
    scenes: tuple[Path, ...] = ()
    left_out: int = 0
    unsaid: int = 0
    problem: str = ""


@dataclass(frozen=True)
class Film:
    """A film that was looked through. chosen: indices of its stills, in order. left: frames left out, by
    reason, of the choice that was `proposed`. notes: sentences. reasons: why each still is left out where it
    is."""

    path: Path
    strip: Strip
    chosen: tuple[int, ...]
    left: tuple[tuple[str, int], ...] = ()
    notes: tuple[str, ...] = ()
    proposed: tuple[int, ...] = ()
    reasons: tuple[str, ...] = ()

    @property
    def left_out(self) -> dict[str, int]:
        """Frames left out now, by reason; together with the chosen ones all that were looked at."""
        left, before, now = dict(self.left), set(self.proposed), set(self.chosen)
        for index in before - now:
            left[self.reasons[index]] = left.get(self.reasons[index], 0) + 1
        for index in sorted(now - before):
            why = self.reasons[index]
            if not left.get(why):  # a still as blurred as others that was proposed for lack of these
                why = "between" if left.get("between") else max(left, key=lambda key: left[key])
            left[why] -= 1
        return left

    @property
    def frames(self) -> tuple[Path, ...]:
        """The chosen frames as files."""
        return tuple(self.strip.path(index) for index in self.chosen)


@dataclass(frozen=True)
class Opening:
    """The opening half of the state. folder: None while it is read. chosen: in the order of the clicks.
    asker: the dialog that wants a folder for its file. name: of that file. pending: commands that wait for
    that dialog. film: the one that was looked through last."""

    folder: Folder | None = None
    chosen: tuple[Path, ...] = ()
    asker: Dialog | None = None
    name: str = ""
    pending: tuple[Command, ...] = ()
    film: Film | None = None


NO_OPENING = Opening()


def told_film(film: Film) -> dict:
    """What a scene's record says of frames that were not taken, as `Record.left_out` has it."""
    why = {REASONS[key]: count for key, count in film.left_out.items() if count}
    return {"film": film.strip.film, "frames": film.strip.num_looked_at, "why": why}


def small(path: Path) -> str:
    """What the small picture of a photo in a folder is called."""
    return f"in folder {path}"


def sample(place: int) -> str:
    """What the small picture of a pair of sample photos is called."""
    return f"sample {place}"
