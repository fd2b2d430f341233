"""The log that a person can read: what was shown as a message, and what the program warned of."""

import logging
from collections.abc import Callable

from .commands import Command, Log
from .effects import Effects, Hands
from .state import State

_PROGRAM = logging.getLogger(__name__.partition(".")[0])


class LogEffects(Effects):
    """Keeps the log while the window is open."""

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
