"""What the disk has at the path that is typed in a dialog: looked up here, so that panels need not ask."""

from .commands import Command, LookedUp
from .dialogs import Dialog
from .effects import Effects, Hands
from .scene.drops import look_up
from .state import State


class TypedEffects(Effects):
    """Asks the disk after every command while such a dialog is open: other programs write files too."""

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
