"""What commands ask of the world outside the state: the worker, the disk, the picture.

Each feature has its own effects; here those that none owns. The session hands every command to all of them
after its pure change, and calls them around each picture; main thread only.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass

from langflash_core.base.memory import give_back

from .commands import Command, Log, LookedUp, Measured, Tick
from .dialogs import Dialog
from .requests import Job, Task
from .scene.drops import look_up
from .state import State

REST_SECONDS = 1.0  # without a command until what is free is given back, which takes some milliseconds
_PROGRAM = logging.getLogger(__name__.partition(".")[0])


@dataclass(frozen=True)
class Hands:
    """What effects act with.

    perform: a command, at once. dispatch: a command from any thread, for the next frame. submit: a
    request of the worker. cancel: the worker's job. now: seconds of the session's clock.
    """

    perform: Callable[[Command], None]
    dispatch: Callable[[Command], None]
    submit: Callable[[Job | Task], None]
    cancel: Callable[[], None]
    now: Callable[[], float]


class Effects:
    """Of one feature; here none."""

    @property
    def due(self) -> float:
        """When `tick` has something to do next, on the session's clock."""
        return float("inf")

    def tick(self, state: State, now: float) -> None:
        """Do what has become due."""

    def follow(self, command: Command, before: State, state: State) -> None:
        """What a command asks of the world, after its pure change."""

    def before_picture(self, state: State) -> None:
        """Bring what the picture must show to the renderer.

        Raises:
            LangFlashError: the renderer cannot.
        """

    def after_picture(self, state: State) -> None:
        """Read what is wanted of the picture."""

    def close(self, state: State, crashed: bool) -> None:
        """At the end, when the worker is gone."""


class LogEffects(Effects):
    """The log that a person can read: what was shown as a message, and what the program warned of."""

    def __init__(self, hands: Hands) -> None:
        self._perform = hands.perform
        self._handler = _LogToWindow(hands.dispatch)
        _PROGRAM.addHandler(self._handler)

    def follow(self, command: Command, before: State, state: State) -> None:
        """A new message is a line, too."""
        known = {toast.key for toast in before.toasts}
        for toast in state.toasts:
            if toast.key not in known:
                self._perform(Log(toast.kind, toast.text))

    def close(self, state: State, crashed: bool) -> None:
        """Listen no more."""
        _PROGRAM.removeHandler(self._handler)


class _LogToWindow(logging.Handler):
    """Warnings and errors of the program as lines of the log."""

    def __init__(self, dispatch: Callable[[Command], None]) -> None:
        super().__init__(logging.WARNING)
        self._dispatch = dispatch

    def emit(self, record: logging.LogRecord) -> None:
        kind = "error" if record.levelno >= logging.ERROR else "info"
        self._dispatch(Log(kind, record.getMessage()))


class TypedEffects(Effects):
    """What the disk has at the path that is typed in a dialog, so that panels need not ask. It is asked after
    every command while such a dialog is open: other programs write files too."""

    def __init__(self, hands: Hands) -> None:
        self._hands = hands

    def follow(self, command: Command, before: State, state: State) -> None:
        """Tell what is new."""
        if state.dialog is None or not state.dialog.types:
            return
        shown = state.opening.folder if state.dialog.looks else None
        folder = None if shown is None else shown.path
        there = look_up(state.typed.text, scene=state.dialog is Dialog.SAVE, folder=folder)
        if there is not state.typed.there:
            self._hands.perform(LookedUp(state.typed.text, there))


class RestEffects(Effects):
    """Gives memory back that is free, once nothing happens in the window."""

    def __init__(self, hands: Hands) -> None:
        self._hands = hands
        self._due = float("inf")

    @property
    def due(self) -> float:
        """When the window will have rested long enough."""
        return self._due

    def tick(self, state: State, now: float) -> None:
        """Give back what pictures, jobs and tasks left free."""
        if now >= self._due:
            self._due = float("inf")
            give_back()

    def follow(self, command: Command, before: State, state: State) -> None:
        """Whatever happens may leave something."""
        if not isinstance(command, Tick | Measured):
            self._due = self._hands.now() + REST_SECONDS
