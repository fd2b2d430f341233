"""What can happen to a tour. Every change is an entry of the history; what cannot be is told in a
sentence."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from langflash_core.base import pictures
from langflash_core.errors import InputError
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene.settings import TOURS
from langflash_core.scene.tour import Note, Stop, Tour, check_tour, told_tour

from ..asking.commands import AddPrompt, EditPrompt, SelectPrompt, ShowPrompt
from ..asking.prompt_sets import MOST_PROMPTS
from ..commands import Notify
from ..editing.commands import with_edit
from ..filming.state import Walk
from ..scene.state import Flight
from ..state import State


@dataclass(frozen=True)
class ShowTour:
    """The panel, or no longer."""

    open: bool

    def apply(self, state: State) -> State:
        return state.with_touring(open=self.open)


@dataclass(frozen=True)
class NotesJudged:
    """Which notes lie behind what the picture shows."""

    behind: frozenset[Note]

    def apply(self, state: State) -> State:
        return state.with_touring(behind=self.behind)


@dataclass(frozen=True)
class AddStop:
    """The present view is the next stop; what is asked now is asked there."""

    def apply(self, state: State) -> State:
        tour = state.tour
        number = next(n for n in range(1, 1000) if f"Stop {n}" not in tour.names)
        prompt = state.asking.active_prompt
        phrase = prompt.text.strip()[: TOURS.longest_text] if prompt and state.scene.mode.answers else ""
        stop = Stop(f"Stop {number}", state.scene.pose, phrase=phrase)
        after = _with_tour(state, f"Add stop {number}", lambda tour: tour.with_stop(stop))
        return after.with_touring(open=True, place=len(after.tour.stops) - 1)


@dataclass(frozen=True)
class ChangeStop:
    """Other words of a stop, or its view: the present one."""

    place: int
    name: str | None = None
    text: str | None = None
    here: bool = False

    def apply(self, state: State) -> State:
        told = {"name": self.name, "text": self.text, "pose": state.scene.pose if self.here else None}
        changes: dict[str, Any] = {name: value for name, value in told.items() if value is not None}
        label = f"Change stop {self.place + 1}"
        return _with_tour(state, label, lambda tour: tour.changed_stop(self.place, **changes))


@dataclass(frozen=True)
class MoveStop:
    """A stop to another place in the order."""

    place: int
    to: int

    def apply(self, state: State) -> State:
        label = f"Move stop {self.place + 1}"
        return _with_tour(state, label, lambda tour: tour.moved_stop(self.place, self.to))


@dataclass(frozen=True)
class RemoveStop:
    """A stop less."""

    place: int

    def apply(self, state: State) -> State:
        label = f"Remove stop {self.place + 1}"
        after = _with_tour(state, label, lambda tour: tour.without_stop(self.place))
        return after.with_touring(place=-1).with_filming(tour=None)


@dataclass(frozen=True)
class StartAt:
    """Where pages of the scene open; an empty name: as without a tour."""

    name: str

    def apply(self, state: State) -> State:
        label = f"Start at {self.name or 'the first photo'}"
        return _with_tour(state, label, lambda tour: tour.started(self.name))


@dataclass(frozen=True)
class AddNote:
    """Words at a point, or a measure between two. phrase: what is asked by who chooses it."""

    text: str
    at: Vector
    to: Vector | None = None
    phrase: str = ""

    def apply(self, state: State) -> State:
        note = Note(self.text[: TOURS.longest_text], self.at, self.to, self.phrase)
        return _with_tour(state, "Pin a note", lambda tour: tour.with_note(note)).with_touring(open=True)


@dataclass(frozen=True)
class ChangeNote:
    """Other words of a note."""

    place: int
    text: str

    def apply(self, state: State) -> State:
        notes = list(state.tour.notes)
        notes[self.place] = replace(notes[self.place], text=self.text)
        label = f"Change note {self.place + 1}"
        return _with_tour(state, label, lambda tour: check_tour(replace(tour, notes=tuple(notes))))


@dataclass(frozen=True)
class RemoveNote:
    """A note less."""

    place: int

    def apply(self, state: State) -> State:
        label = f"Remove note {self.place + 1}"
        return _with_tour(state, label, lambda tour: tour.without_note(self.place))


@dataclass(frozen=True)
class GoToStop:
    """Fly to a stop, and ask what is asked there."""

    place: int

    def apply(self, state: State) -> State:
        stops = state.tour.stops
        if not stops:
            return Notify("There are no stops yet; fly somewhere and add one.", "info").apply(state)
        place = self.place % len(stops)
        flight = Flight(state.scene.pose, stops[place].pose, state.now)
        state = state.with_scene(flight=flight, view=None).with_filming(tour=None)
        state = state.with_touring(place=place)
        return asked(state, stops[place].phrase)


@dataclass(frozen=True)
class Step:
    """The next stop, or the one before."""

    by: int

    def apply(self, state: State) -> State:
        at = state.touring.place
        return GoToStop(0 if at < 0 and self.by > 0 else at + self.by).apply(state)


@dataclass(frozen=True)
class Play:
    """A walk past all stops, as a film of the tour goes."""

    def apply(self, state: State) -> State:
        stops: tuple[Pose, ...] = tuple(stop.pose for stop in state.tour.stops)
        if len(stops) < 2:
            text = "A tour needs two or more stops; fly somewhere and add one."
            return Notify(text, "info").apply(state)
        return state.with_filming(tour=Walk(stops, state.now)).with_scene(flight=None, view=None)


def asked(state: State, phrase: str) -> State:
    """A phrase of a stop or a note on show: its row, an empty one or, while there is room, a new one."""
    if not phrase:
        return state
    rows = state.asking.prompts
    row = next((p for p in rows if p.text.strip().lower() == phrase.lower()), None)
    if row is not None:
        state = SelectPrompt(row.key).apply(ShowPrompt(row.key, True).apply(state))
    else:
        if all(p.text.strip() for p in rows):
            if len(rows) >= MOST_PROMPTS:
                return state
            state = AddPrompt().apply(state)
        empty = next(p for p in state.asking.prompts if not p.text.strip())
        state = EditPrompt(empty.key, phrase).apply(state).with_asking(caret=None)
    return state.with_scene(mode=pictures.HEAT) if state.scene.mode is pictures.RGB else state


@dataclass(frozen=True)
class AskNote:
    """What a note asks."""

    place: int

    def apply(self, state: State) -> State:
        return asked(state, state.tour.notes[self.place].phrase)


def _with_tour(state: State, label: str, make: Callable[[Tour], Tour]) -> State:
    """Another tour, as an edit; the same and a sentence where it cannot be."""
    marks = state.editing.marks
    if marks is None:
        return state
    try:
        return with_edit(state, label, replace(marks, tour=told_tour(make(state.tour))))
    except InputError as problem:
        return Notify(str(problem)[0].upper() + str(problem)[1:] + ".").apply(state)
