"""What a window does once nothing happens in it: it gives memory back."""

from langflash_core.base.memory import give_back

from .commands import Command, Measured, Tick
from .effects import Effects, Hands
from .state import State

REST_SECONDS = 1.0  # without a command until what is free is given back, which takes some milliseconds


class RestEffects(Effects):
    """Gives back what is free once the window has come to rest."""

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
