"""What a command is, for those that keep some until they are wanted; it lies below the state."""

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from .state import State


class Command(Protocol):
    """Anything with a pure change of state."""

    def apply(self, state: "State") -> "State": ...


class Outward:
    """A command that only effects act on."""

    def apply(self, state: "State") -> "State":
        return state
