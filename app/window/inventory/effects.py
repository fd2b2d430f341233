"""What the inventory asks of the world: the worker, for a list of what is there by now."""

from ..commands import Command
from ..effects import Effects, Hands
from ..state import State
from .commands import Looking
from .work import TakeInventory


class InventoryEffects(Effects):
    """While the panel is open its list is of the scene as it is; a moment after the last edit, so that what a
    hand still changes is not looked for again and again."""

    PAUSE = 0.6  # seconds

    def __init__(self, hands: Hands) -> None:
        self._hands = hands
        self._about: tuple | None = None  # what the list is of
        self._look_at = float("inf")

    @property
    def due(self) -> float:
        """When things are looked for."""
        return self._look_at

    def follow(self, command: Command, before: State, state: State) -> None:
        """Look again once what the list is of is another."""
        same = state.editing.marks is before.editing.marks and state.scene.info is before.scene.info
        if same and state.listing.open == before.listing.open:
            return
        about = _about(state)
        if about is not None and about != self._about:
            self._look_at = self._hands.now() + (0.0 if state.listing.rows is None else self.PAUSE)

    def tick(self, state: State, now: float) -> None:
        """Ask the worker."""
        if now < self._look_at:
            return
        self._look_at, about = float("inf"), _about(state)
        info, marks = state.scene.info, state.editing.marks
        if about is None or info is None or marks is None:
            return
        self._about = about
        self._hands.perform(Looking())
        self._hands.submit(TakeInventory(info.serial, info.memory, marks))


def _about(state: State) -> tuple | None:
    """What a list is of; None while none is shown."""
    info, marks = state.scene.info, state.editing.marks
    if not state.listing.open or info is None or marks is None:
        return None
    return (
        info.serial,
        marks.there,
        marks.deleted,
        marks.changes,
        marks.atoms,
        marks.world,
        marks.metric_scale,
    )
