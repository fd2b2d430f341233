"""Films on the command line: which frames of them are taken, and how that is told."""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from langflash_core.base.files import readable_file
from langflash_core.base.formats import is_film
from langflash_core.base.running import Progress
from langflash_core.errors import FilmError, InputError
from langflash_core.images.settings import PHOTO_LIMITS
from langflash_core.images.strip import REASONS, Choice, Strip, choose, notes_on


def look_through(
    path: Path,
    progress: Progress,
    *,
    start: float = 0.0,
    end: float | None = None,
    every: float | None = None,
) -> Strip:
    """The stills of a film, with progress and the time that remains.

    Raises:
        InputError: it is missing or cannot be used, or the part is empty.
    """
    readable_file(path, "film", FilmError)
    if end is not None and end <= start:
        raise InputError(f"--to {end:g} is not after --from {start:g}; choose a later second")
    from langflash_core.images.frames import remaining, strip_of

    began = time.monotonic()

    def told(_stage: str, fraction: float) -> None:
        progress(f"looking through {path.name}{remaining(fraction, began)}", fraction)

    return strip_of(path, start=start, end=end, every=every, progress=told)


def with_frames(
    photos: Sequence[Path],
    progress: Progress,
    *,
    most: int | None = None,
    start: float = 0.0,
    end: float | None = None,
) -> tuple[list[Path], list[dict[str, Any]], list[str]]:
    """Photos with films replaced by their frames; what is told of each film; and notes for people.

    Args:
        most: frames of each film; None: `PHOTO_LIMITS.film_photos`, or as many as there is room for beside
            photos and other films.

    Raises:
        InputError: a film cannot be used, or there are no films and yet options for them, or too many photos.
    """
    films = [path for path in photos if is_film(path)]
    if not films:
        if most is not None or start or end is not None:
            raise InputError("--frames, --from and --to are for films; leave them out")
        return list(photos), [], []
    room = (PHOTO_LIMITS.max_photos - len(photos) + len(films)) // len(films)
    if room < 2:
        raise InputError(f"{len(photos) - len(films)} photos leave no room for frames; choose fewer photos")
    taken, told, notes = list[Path](), list[dict[str, Any]](), list[str]()
    for path in photos:
        if not is_film(path):
            taken.append(path)
            continue
        strip = look_through(path, progress, start=start, end=end)
        choice = choose(strip, min(most or PHOTO_LIMITS.film_photos, room))
        taken += [strip.path(index) for index in choice.chosen]
        told.append(summary(strip, choice))
        notes += notes_on(strip, choice)
    return taken, told, notes


def summary(strip: Strip, choice: Choice) -> dict[str, Any]:
    """What is told of a film, for programs."""
    return {
        "film": strip.film,
        "seconds": strip.seconds,
        "frames_looked_at": strip.num_looked_at,
        "chosen": len(choice.chosen),
        "left_out": choice.left,
        "widest_gap": round(choice.gap, 3),
    }


def recorded(film: Mapping[str, Any]) -> dict[str, Any]:
    """The same as a scene's record has it, `Record.left_out`."""
    why = {said: film["left_out"][key] for key, said in REASONS.items() if film["left_out"].get(key)}
    return {"film": film["film"], "frames": film["frames_looked_at"], "why": why}


def sentence(strip: Strip, choice: Choice) -> str:
    """The same for people."""
    left = [f"{choice.left[key]} {said}" for key, said in REASONS.items() if choice.left[key]]
    rest = f"; {', '.join(left)}" if left else ""
    return f"{len(choice.chosen)} of {strip.num_looked_at} frames{rest}"
