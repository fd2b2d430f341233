"""What commands ask of the world outside the state: the worker, the disk, the picture.

Each feature has its own effects. The session hands every command to all of them after its pure
change, and calls them around each picture; main thread only.
"""

from collections.abc import Callable
from dataclasses import dataclass

from .commands import Command
from .requests import Job, Task
from .state import State


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
