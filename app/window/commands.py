"""What can happen, one frozen dataclass each; `apply(state, command)` is the next state, purely.

Here those that no feature owns; the others are in the features' own `commands`. A command that also
needs the outside world (the worker, a file, the picture) is seen once more by its feature's `effects`
after its pure change. Times come from `state.now`.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from langflash_core.geometry import poses

from .asking.state import PROMPT_DIALOGS, PROMPTS_SUFFIX
from .scene import samples
from .scene.drops import SCENE_SUFFIX
from .scene.state import FLIGHT_SECONDS
from .state import MOST_LINES, NO_PALETTE, TOAST_SECONDS, Line, Palette, State, Stats, Toast

NOTHING_TO_SAVE = "There is no scene to save; drop photos on the window first."


class Command(Protocol):
    """Anything with a pure change of state."""

    def apply(self, state: State) -> State: ...


def apply(state: State, command: Command) -> State:
    """The state after `command`."""
    return command.apply(state)


@dataclass(frozen=True)
class OfScene:
    """A command that holds for one scene, and for no other that has come meanwhile."""

    serial: int
    command: Command

    def holds(self, state: State) -> bool:
        """Whether its scene is on show; 0 is the number of no scene."""
        return self.serial == (state.info.serial if state.info else 0)

    def apply(self, state: State) -> State:
        return self.command.apply(state) if self.holds(state) else state


@dataclass(frozen=True)
class Tick:
    """Time passes: flights advance, old toasts go."""

    now: float

    def apply(self, state: State) -> State:
        toasts = tuple(t for t in state.toasts if t.until > self.now)
        pose, flight = state.pose, state.flight
        if flight is not None:
            fraction = (self.now - flight.began) / FLIGHT_SECONDS
            pose = poses.blend(flight.start, flight.end, fraction)
            flight = flight if fraction < 1.0 else None
        tour = state.tour
        if tour is not None:
            there = tour.at(self.now)
            pose, tour = (tour.poses[-1], None) if there is None else (there, tour)
        return replace(state, now=self.now, toasts=toasts, pose=pose, flight=flight, tour=tour)


@dataclass(frozen=True)
class Notify:
    """Show a message; the same text is shown once."""

    text: str
    kind: str = "error"

    def apply(self, state: State) -> State:
        others = tuple(t for t in state.toasts if t.text != self.text)
        toast = Toast(state.next_key, self.text, self.kind, state.now + TOAST_SECONDS[self.kind])
        return replace(state, toasts=(*others, toast)[-4:], next_key=state.next_key + 1)


@dataclass(frozen=True)
class DismissToast:
    """Take a message away."""

    key: int

    def apply(self, state: State) -> State:
        return replace(state, toasts=tuple(t for t in state.toasts if t.key != self.key))


@dataclass(frozen=True)
class Log:
    """One more line of the log; the oldest ones go."""

    kind: str
    text: str

    def apply(self, state: State) -> State:
        line = Line(state.now, self.kind, self.text)
        return replace(state, lines=(*state.lines, line)[-MOST_LINES:])


@dataclass(frozen=True)
class CopyText:
    """Put text on the clipboard (the session does)."""

    text: str

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class ShowPicture:
    """Keep a small picture, (h, w, 3) uint8, for panels that ask for `key` (the session does)."""

    key: str
    rgb: np.ndarray = field(compare=False, repr=False)

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class ShowDialog:
    """`which` is a key of `frame.dialogs.TITLES`; None closes. Nothing waits for an answer any more."""

    which: str | None

    def apply(self, state: State) -> State:
        if self.which == "save" and state.info is None:
            return Notify(NOTHING_TO_SAVE).apply(state)
        path = str(_place_to_save(state)) if self.which == "save" else ""
        if self.which in PROMPT_DIALOGS:
            path = str(state.asking.prompts_path or Path.home() / f"my{PROMPTS_SUFFIX}")
        return replace(state, dialog=self.which, dialog_path=path, palette=NO_PALETTE, pending=())


@dataclass(frozen=True)
class EditDialogPath:
    """New text in the dialog's path field."""

    path: str

    def apply(self, state: State) -> State:
        return replace(state, dialog_path=self.path)


@dataclass(frozen=True)
class EditPalette:
    """Other words in the command palette, or another choice."""

    palette: Palette

    def apply(self, state: State) -> State:
        return replace(state, palette=self.palette)


@dataclass(frozen=True)
class Leave:
    """Close the window; asks first when a scene would be lost, unless `sure`."""

    sure: bool = False

    def apply(self, state: State) -> State:
        unsaved = state.info is not None and state.info.path is None
        if unsaved and not self.sure:
            return replace(state, dialog="leave")
        return replace(state, leaving=True, dialog=None)


@dataclass(frozen=True)
class PictureDrawn:
    """A still picture is ready to be shown."""

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class Measured:
    """Figures for the status bar."""

    stats: Stats

    def apply(self, state: State) -> State:
        return replace(state, stats=self.stats)


def _place_to_save(state: State) -> Path:
    """The scene's own file, or one beside its photos."""
    if state.info is not None and state.info.path is not None:
        return state.info.path
    return samples.beside(state.photos).with_suffix(SCENE_SUFFIX)
