"""A guided tour of a scene: *stops*, which are named poses in an order, and *notes*, which are pinned to
points.

Idea: it is told as plain JSON values in the scene's record, so programs that know nothing of tours keep it
as it is. A note names a thing, or measures the length between two points. A stop and a note may have a
phrase, which is asked where people come to them. Imports no torch.

    {"stops": [{"name", "pose", "text", "phrase"}], "notes": [{"text", "at", "to", "phrase"}], "start": name}

Empty texts, phrases, `to` and `start` are left out. Points are in scene units, poses as `told_pose` has them.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from langflash_core.errors import InputError
from langflash_core.geometry.poses import Pose, Vector, read_pose, told_pose
from langflash_core.scene.settings import TOURS


@dataclass(frozen=True)
class Stop:
    """A named pose. text: what is told there. phrase: what is asked there, or nothing."""

    name: str
    pose: Pose
    text: str = ""
    phrase: str = ""


@dataclass(frozen=True)
class Note:
    """Words at a point, scene units. to: where the length that it measures ends; None: it measures none.
    phrase: what is asked by who chooses it, or nothing."""

    text: str
    at: Vector
    to: Vector | None = None
    phrase: str = ""

    @property
    def length(self) -> float | None:
        """What it measures, in scene units."""
        return None if self.to is None else math.dist(self.at, self.to)


@dataclass(frozen=True)
class Tour:
    """Stops in their order, notes, and the name of the stop where a scene opens, or nothing."""

    stops: tuple[Stop, ...] = ()
    notes: tuple[Note, ...] = ()
    start: str = ""

    def __bool__(self) -> bool:
        return bool(self.stops or self.notes)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the stops."""
        return tuple(stop.name for stop in self.stops)

    def with_stop(self, stop: Stop, place: int | None = None) -> "Tour":
        """With one more, last unless a place from 0 is told.

        Raises:
            InputError: it has the name of another, or there are too many.
        """
        stops = list(self.stops)
        stops.insert(len(stops) if place is None else place, stop)
        return check_tour(replace(self, stops=tuple(stops)))

    def with_note(self, note: Note) -> "Tour":
        """With one more.

        Raises:
            InputError: it says nothing, or there are too many.
        """
        return check_tour(replace(self, notes=(*self.notes, note)))

    def changed_stop(self, place: int, **changes: Any) -> "Tour":
        """With other values of one stop; the start keeps being what it was.

        Raises:
            InputError: it would have the name of another.
        """
        old, stops = self.stops[place], list(self.stops)
        stops[place] = replace(old, **changes)
        start = stops[place].name if self.start == old.name else self.start
        return check_tour(replace(self, stops=tuple(stops), start=start))

    def moved_stop(self, place: int, to: int) -> "Tour":
        """With a stop at another place, from 0."""
        stops = list(self.stops)
        stops.insert(max(0, min(to, len(stops) - 1)), stops.pop(place))
        return replace(self, stops=tuple(stops))

    def without_stop(self, place: int) -> "Tour":
        """One stop less; if a scene opened there, it opens as it did before."""
        gone = self.stops[place]
        stops = (*self.stops[:place], *self.stops[place + 1 :])
        return replace(self, stops=stops, start="" if self.start == gone.name else self.start)

    def without_note(self, place: int) -> "Tour":
        """One note less."""
        return replace(self, notes=(*self.notes[:place], *self.notes[place + 1 :]))

    def started(self, name: str) -> "Tour":
        """Opening at a stop; an empty name: as a scene without a tour does.

        Raises:
            InputError: there is no such stop.
        """
        return check_tour(replace(self, start=name))


NO_TOUR = Tour()


def check_tour(tour: Tour) -> Tour:
    """The tour, its words trimmed.

    Raises:
        InputError: says what cannot be.
    """
    stops = tuple(
        replace(s, name=_line(s.name), text=s.text.strip(), phrase=_line(s.phrase)) for s in tour.stops
    )
    notes = tuple(replace(n, text=n.text.strip(), phrase=_line(n.phrase)) for n in tour.notes)
    tour = Tour(stops, notes, _line(tour.start))
    for what, most, found in (("stops", TOURS.most_stops, stops), ("notes", TOURS.most_notes, notes)):
        if len(found) > most:
            raise InputError(f"a tour has at most {most} {what}, not {len(found)}; remove some")
    _check_words(tour)
    return tour


def _check_words(tour: Tour) -> None:
    """Raises:
    InputError: a name is missing, twice there or unknown, or a text is missing or too long.
    """
    for name in tour.names:
        if not name or len(name) > TOURS.longest_name:
            raise InputError(
                f"a stop's name has 1 to {TOURS.longest_name} letters, not {len(name)}; name it anew"
            )
        if tour.names.count(name) > 1:
            raise InputError(f"there is a stop called {name} already; choose another name")
    if tour.start and tour.start not in tour.names:
        raise InputError(
            f"there is no stop called {tour.start}; the tour has {', '.join(tour.names) or 'none'}"
        )
    for note in tour.notes:
        if not note.text and note.to is None and not note.phrase:
            raise InputError("a note says nothing; give it a text, a phrase, or a second point to measure to")
    texts = [text for each in (*tour.stops, *tour.notes) for text in (each.text, each.phrase)]
    if any(len(text) > TOURS.longest_text for text in texts):
        raise InputError(f"a text has at most {TOURS.longest_text} letters; say it shorter")


def _line(text: str) -> str:
    return " ".join(text.split())


def told_tour(tour: Tour) -> dict[str, Any]:
    """Plain values for a record or a file; none of an empty tour."""
    told: dict[str, Any] = {}
    if tour.stops:
        told["stops"] = [
            {"name": s.name, "pose": told_pose(s.pose), **_some(text=s.text, phrase=s.phrase)}
            for s in tour.stops
        ]
    if tour.notes:
        told["notes"] = [
            {**_some(text=n.text), "at": list(n.at), **_some(to=list(n.to or ()), phrase=n.phrase)}
            for n in tour.notes
        ]
    return told | _some(start=tour.start)


def _some(**values: Any) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value}


def read_tour(told: Mapping[str, Any]) -> Tour:
    """A tour out of plain values.

    Raises:
        ValueError: says what is damaged.
    """
    try:
        stops = tuple(_stop(entry) for entry in _entries(told, "stops"))
        notes = tuple(_note(entry) for entry in _entries(told, "notes"))
        return check_tour(Tour(stops, notes, _text(told, "start")))
    except InputError as error:
        raise ValueError(f"tour: {error}") from error
    except (KeyError, TypeError, IndexError, AttributeError, OverflowError) as error:
        raise ValueError(f"tour: a stop or a note is damaged ({error})") from error


def _entries(told: Mapping[str, Any], name: str) -> Iterable[Mapping[str, Any]]:
    found = told.get(name, [])
    if not isinstance(found, list | tuple):
        raise ValueError(f"tour: expected a list of {name}, received {found!r}"[:200])
    return found


def _stop(entry: Mapping[str, Any]) -> Stop:
    pose = read_pose(entry["pose"])
    return Stop(_text(entry, "name"), pose, _text(entry, "text"), _text(entry, "phrase"))


def _note(entry: Mapping[str, Any]) -> Note:
    to = entry.get("to")
    return Note(
        _text(entry, "text"), _point(entry["at"]), None if to is None else _point(to), _text(entry, "phrase")
    )


def _text(entry: Mapping[str, Any], name: str) -> str:
    text = entry.get(name, "")
    if not isinstance(text, str):
        raise ValueError(f"tour: expected a text for {name}, received {text!r}"[:200])
    return text


def _point(values: Any) -> Vector:
    point = tuple(map(float, values))
    if len(point) != 3 or not all(map(math.isfinite, point)):
        raise ValueError(f"tour: expected three finite numbers for a point, received {values!r}"[:200])
    return Vector(*point)
