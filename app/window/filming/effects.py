"""What filming asks of the world: the way, of the worker."""

from ..commands import Command
from ..effects import Effects, Hands
from ..state import State
from .commands import Preview
from .work import PlanTour


class FilmingEffects(Effects):
    """Plans a preview."""

    def __init__(self, hands: Hands) -> None:
        self._hands = hands

    def follow(self, command: Command, before: State, state: State) -> None:
        """As long as a film would take."""
        if isinstance(command, Preview) and len(state.keys) >= 2:
            self._hands.submit(PlanTour(state.keys, state.exporting.form.seconds))
