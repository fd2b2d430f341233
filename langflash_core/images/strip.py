"""What a film offers to choose from, and the choice: sharp frames, spaced by how far the picture moves.

A `Still` is the sharpest frame of a piece of film that moves by a few hundredths of the picture; a `Strip`
has those of one film, kept as files. Choosing again, with more or fewer, needs no film. Neither
OpenCV nor torch is needed here.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from langflash_core.errors import FilmError
from langflash_core.images.settings import CHOOSING, PHOTO_LIMITS

FORMAT = 3
INDEX = "strip.json"
REPEAT, ELSEWHERE = "repeat", "elsewhere"
REASONS = {
    "between": "lay between the chosen ones",
    "blurred": "were blurred",
    "repeats": "showed what others show",
    "dark": "were dark",
    "plain": "showed nothing to follow",
    "other_shots": "were of other places",
    "beyond": "came later than one scene can cover",
}
"""Why frames are left out, for people."""


@dataclass(frozen=True)
class Still:
    """A frame to choose. file: its name in the strip's folder. sharpness: variance of its Laplacian. place:
    how far the film had moved. looks: frames that it stands for, `blurred` of them. smear: pixels over which
    its edges rise, by what is usual in the film; 0 where that cannot be told. why_not: a reason, or none."""

    file: str
    seconds: float
    sharpness: float
    place: float
    looks: int
    blurred: int = 0
    smear: float = 0.0
    why_not: str = ""


@dataclass(frozen=True)
class Strip:
    """A film's stills in order. seconds: of film that were looked at, its last picture's included. dark,
    plain: frames in which nothing can be followed. shots: how many there are, those of one room as one.
    notes: for people."""

    film: str
    folder: Path
    seconds: float
    stills: tuple[Still, ...]
    dark: int = 0
    plain: int = 0
    shots: int = 1
    every: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def num_looked_at(self) -> int:
        """Frames that were looked at."""
        return sum(still.looks for still in self.stills) + self.dark + self.plain

    def path(self, index: int) -> Path:
        """Where a still is."""
        return self.folder / self.stills[index].file


@dataclass(frozen=True)
class Choice:
    """Indices of chosen stills, and the sharpness of all, as a share of the sharpest near each. left: how
    many frames were left out, by reason. gap: the widest between two, a share of the side. until:
    the second where the part ends that the photos of one scene can cover; None: all of the film."""

    chosen: tuple[int, ...]
    relative: Float[np.ndarray, " S"]
    left: dict[str, int]
    gap: float
    until: float | None = None


def choose(strip: Strip, most: int, fewest: int = 2) -> Choice:
    """The sharpest frames of a film, evenly spaced along its way; at most so many, and as few as show all,
    but not under `fewest` where there are so many.

    Of the stills of one shot, without repeats and blurred ones, those are taken for which the sum of log
    sharpness, less what uneven gaps cost, is highest: exact, by dynamic programming.

    Raises:
        FilmError: fewer than two can be chosen.
    """
    stills = strip.stills
    usable = np.array([not still.why_not for still in stills], dtype=bool)
    places, sharpness = _places(stills, usable), np.array([still.sharpness for still in stills])
    relative = _relative(places, sharpness, usable)
    smears = np.array([still.smear for still in stills], dtype=np.float64)
    taken = _without_blurred(places, relative, smears, usable)
    blurred = usable & ~taken
    way = float(np.ptp(places[usable])) if usable.any() else 0.0
    if usable.sum() < 2 or way < CHOOSING.stands:
        raise FilmError(
            f"{strip.film} stands still, all its frames show the same; walk around the room while filming"
        )
    until = None
    if strip.every is not None:
        chosen = _evenly(np.flatnonzero(taken), most)
    else:
        reach = CHOOSING.apart * (max(most, PHOTO_LIMITS.film_photos) - 1)
        covered = places <= places[usable][0] + reach
        if not covered.all():
            until = stills[int(np.flatnonzero(covered)[-1])].seconds
            taken, way = taken & covered, reach
        count = min(max(round(way / CHOOSING.spacing) + 1, fewest), most, int(taken.sum()))
        indices = np.flatnonzero(taken)
        chosen = indices[_best(places[indices], np.log(relative[indices].clip(0.05)), count)]
    gaps = np.diff(places[chosen])
    gap = float(gaps.max()) if len(gaps) else 0.0
    left = _count_left_out(strip, blurred, until, chosen.tolist())
    return Choice(tuple(chosen.tolist()), relative, left, gap, until)


def notes_on(strip: Strip, choice: Choice) -> tuple[str, ...]:
    """What people should know of a choice, a sentence each."""
    notes = list(strip.notes)
    if choice.until is not None:
        most = max(len(choice.chosen), PHOTO_LIMITS.film_photos)
        notes.append(
            f"{strip.film} shows more than {most} photos can cover, what comes after {choice.until:.1f} s is "
            "left out; more frames cover more, and --from and --to tell another part"
        )
    if choice.gap > 3 * CHOOSING.apart and strip.every is None:
        notes.append(
            f"frames of {strip.film} lie far apart, {choice.gap:.0%} of the picture; "
            "take more of them or, with --from and --to, less of the film"
        )
    return tuple(notes)


def _places(stills: Sequence[Still], usable: Bool[np.ndarray, " S"]) -> Float[np.ndarray, " S"]:
    """How far the film had moved at each still, without what leads through repeats and other rooms."""
    places = np.array([still.place for still in stills], dtype=np.float64)
    steps = np.diff(places, prepend=places[:1])
    before = None
    for index in np.flatnonzero(usable):
        if before is not None and index > before + 1:
            inside = steps[before + 1 : index + 1]
            inside[:] = 0.0
            steps[index] = min(float(places[index] - places[before]), CHOOSING.spacing)
        before = index
    return np.cumsum(steps)


def _relative(
    places: Float[np.ndarray, " S"], sharpness: Float[np.ndarray, " S"], usable: Bool[np.ndarray, " S"]
) -> Float[np.ndarray, " S"]:
    """Sharpness as a share of that of the sharpest usable still near by; only neighbours show the same."""
    near = (np.abs(places[:, None] - places[None]) <= CHOOSING.near) & usable[None]
    best = np.where(near, sharpness[None], 0.0).max(1, initial=0.0)
    return np.minimum(sharpness / np.maximum(best, 1e-6), 1.0)


def _without_blurred(
    places: Float[np.ndarray, " S"],
    relative: Float[np.ndarray, " S"],
    smears: Float[np.ndarray, " S"],
    usable: Bool[np.ndarray, " S"],
) -> Bool[np.ndarray, " S"]:
    """Usable stills, blurred ones only where nothing sharper is seen half a picture around."""
    taken = usable & (relative >= CHOOSING.blurred) & (smears <= CHOOSING.smeared)
    blurred = np.flatnonzero(usable & ~taken)
    for index in blurred[np.argsort(smears[blurred], kind="stable")]:
        kept = places[taken]
        if not len(kept) or float(np.abs(kept - places[index]).min()) > CHOOSING.widest / 2:
            taken[index] = True
    return taken


def _best(
    places: Float[np.ndarray, " S"], worth: Float[np.ndarray, " S"], count: int
) -> Int[np.ndarray, " N"]:
    """`count` of the stills, in order, for which sum of worth - unevenness is highest."""
    spacing = max(float(np.ptp(places)) / max(count - 1, 1), 1e-9)
    ratio = (places[None] - places[:, None]) / spacing  # (from, to)
    cost = np.where(ratio > 0, CHOOSING.uneven * (ratio - 1) ** 2, np.inf)
    cost = np.where((ratio > 0) & (ratio < CHOOSING.narrowest), cost + 10.0, cost)
    index = np.arange(len(places))
    cost[np.tril_indices(len(places))] = np.inf
    cost = np.where(
        (index[None] > index[:, None]) & np.isinf(cost), 1e6, cost
    )  # two at one place, if it must be
    total = worth - CHOOSING.uneven * ((places - places[0]) / spacing) ** 2
    came = np.zeros((count, len(places)), dtype=np.int64)
    for step in range(1, count):
        reached = total[:, None] - cost
        came[step] = reached.argmax(0)
        total = reached.max(0) + worth
    total = total - CHOOSING.uneven * ((places[-1] - places) / spacing) ** 2
    way = [int(total.argmax())]
    for step in range(count - 1, 0, -1):
        way.append(int(came[step, way[-1]]))
    return np.array(way[::-1], dtype=np.int64)


def _evenly(indices: Int[np.ndarray, " S"], most: int) -> Int[np.ndarray, " N"]:
    """At most so many of them, evenly."""
    if len(indices) <= most:
        return indices
    return indices[np.round(np.linspace(0, len(indices) - 1, most)).astype(np.int64)]


def _count_left_out(
    strip: Strip, blurred: Bool[np.ndarray, " S"], until: float | None, chosen: list[int]
) -> dict[str, int]:
    """Frames left out, by reason; together with the chosen ones all that were looked at."""
    left = {"repeats": 0, "other_shots": 0, "beyond": 0, "blurred": 0}
    for index, still in enumerate(strip.stills):
        if still.why_not:
            left["repeats" if still.why_not == REPEAT else "other_shots"] += still.looks
        elif until is not None and still.seconds > until:
            left["beyond"] += still.looks
        else:
            itself = index in chosen and still.smear > CHOOSING.smeared
            left["blurred"] += still.looks if blurred[index] else still.blurred - itself
    left |= {"dark": strip.dark, "plain": strip.plain}
    left["between"] = strip.num_looked_at - len(chosen) - sum(left.values())
    return left


# Files


def encode_index(strip: Strip) -> bytes:
    """The strip's index as a file."""
    entry = asdict(strip) | {"format": FORMAT}
    del entry["folder"]
    return json.dumps(entry, indent=1).encode()


def read_strip(folder: Path) -> Strip | None:
    """The strip that is kept in a folder; None where there is none, or not all of it."""
    try:
        entry: dict[str, Any] = json.loads((folder / INDEX).read_bytes())
        if entry.pop("format") != FORMAT:
            return None
        stills = tuple(Still(**still) for still in entry.pop("stills"))
        notes = tuple(entry.pop("notes"))
        strip = Strip(folder=folder, stills=stills, notes=notes, **entry)
        there = all((folder / still.file).is_file() for still in stills)
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None
    return strip if there else None
