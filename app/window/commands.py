"""What can happen, one frozen dataclass each; `apply(state, command)` is the next state, purely.

Here those that no feature owns; the others are in the features' own `commands`. A command that also
needs the outside world (the worker, a file, the picture) is seen once more by its feature's `effects`
after its pure change. Times come from `state.now`.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from langflash_core.geometry import poses

from .asking.state import PROMPTS_SUFFIX
from .dialogs import PROMPTS, RECIPES, Dialog
from .editing.state import RECIPE_SUFFIX
from .filming.state import Walk
from .protocol import Command as Command
from .protocol import Outward
from .scene import samples
from .scene.drops import There, Typed
from .scene.state import FLIGHT_SECONDS
from .state import MOST_LINES, NO_PALETTE, TOAST_SECONDS, Line, Palette, State, Stats, Toast

NOTHING_TO_SAVE = "There is no scene to save; drop photos on the window first."


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
        return self.serial == (state.scene.info.serial if state.scene.info else 0)

    def apply(self, state: State) -> State:
        return self.command.apply(state) if self.holds(state) else state


@dataclass(frozen=True)
class Tick:
    """Time passes: flights advance, old toasts go."""

    now: float

    def apply(self, state: State) -> State:
        toasts = tuple(t for t in state.toasts if t.until > self.now)
        pose, flight = state.scene.pose, state.scene.flight
        if flight is not None:
            fraction = (self.now - flight.began) / FLIGHT_SECONDS
            pose = poses.blend(flight.start, flight.end, fraction, state.up)
            flight = flight if fraction < 1.0 else None
        tour = state.filming.tour
        if tour is not None:
            if isinstance(tour, Walk):
                state = state.with_touring(place=tour.place(self.now))
            there = tour.at(self.now)
            pose, tour = (tour.poses[-1], None) if there is None else (there, tour)
        return replace(
            state.with_scene(pose=pose, flight=flight).with_filming(tour=tour), now=self.now, toasts=toasts
        )


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
class CopyText(Outward):
    """Put text on the clipboard (the session does)."""

    text: str


@dataclass(frozen=True)
class ShowPicture(Outward):
    """Keep a small picture, (h, w, 3) uint8, for panels that ask for `key` (the session does)."""

    key: str
    rgb: np.ndarray = field(compare=False, repr=False)


@dataclass(frozen=True)
class ShowDialog:
    """None closes the one that is open. Nothing waits for an answer any more."""

    which: Dialog | None

    def apply(self, state: State) -> State:
        if self.which is Dialog.SAVE and state.scene.info is None:
            return Notify(NOTHING_TO_SAVE).apply(state)
        path: Path | str = ""
        if self.which is Dialog.SAVE and state.scene.info is not None:
            path = state.scene.info.path or samples.beside(state.scene.photos)
        elif self.which in PROMPTS:
            path = state.asking.prompts_path or Path.home() / f"my{PROMPTS_SUFFIX}"
        elif self.which in RECIPES:
            path = state.editing.recipe_path or Path.home() / f"my{RECIPE_SUFFIX}"
        typed = Typed(str(path))
        return replace(state.with_scene(pending=()), dialog=self.which, typed=typed, palette=NO_PALETTE)


@dataclass(frozen=True)
class EditDialogPath:
    """New text in the dialog's path field."""

    path: str

    def apply(self, state: State) -> State:
        return replace(state, typed=Typed(self.path))


@dataclass(frozen=True)
class LookedUp:
    """What the disk has at the path that is typed."""

    text: str
    there: There

    def apply(self, state: State) -> State:
        return replace(state, typed=Typed(self.text, self.there)) if state.typed.text == self.text else state


@dataclass(frozen=True)
class EditPalette:
    """Other words in the command palette, or another choice."""

    palette: Palette

    def apply(self, state: State) -> State:
        return replace(state, palette=self.palette)


def unsaved(state: State) -> bool:
    """Whether the scene on show or its edits are in no file."""
    info = state.scene.info
    return info is not None and (info.path is None or state.editing.unsaved)


@dataclass(frozen=True)
class Leave:
    """Close the window; asks first while a scene or its edits are not saved or an export is under way, unless
    `sure`. Saving then closes it too."""

    sure: bool = False

    def apply(self, state: State) -> State:
        if (unsaved(state) or state.exporting.running is not None) and not self.sure:
            return replace(state.with_scene(pending=(Leave(sure=True),)), dialog=Dialog.LEAVE)
        return replace(state, leaving=True, dialog=None)


@dataclass(frozen=True)
class PictureDrawn(Outward):
    """A still picture is ready to be shown."""


@dataclass(frozen=True)
class Measured:
    """Figures for the status bar."""

    stats: Stats

    def apply(self, state: State) -> State:
        return replace(state, stats=self.stats)
