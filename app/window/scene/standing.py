"""How the scene stands: levelled as an edit, on what the worker finds of up, floor and north."""

from dataclasses import dataclass, replace

from langflash_core.base.records import World
from langflash_core.geometry import poses
from langflash_core.scene.report import world_line

from ..commands import Notify
from ..editing.commands import with_edit
from ..state import State
from .camera import FlyTo

LOOKING = "Finding the floor ..."
UNSURE = "The photos do not clearly show which way is up, so this is a guess; Ctrl+Z undoes it."


@dataclass(frozen=True)
class LevelScene:
    """Look how the scene stands; the worker does."""

    def apply(self, state: State) -> State:
        if state.scene.info is None:
            return state
        return Notify(LOOKING, "info").apply(state)


@dataclass(frozen=True)
class Levelled:
    """Where the scene stands: one more edit. The picture comes upright."""

    world: World

    def apply(self, state: State) -> State:
        marks = state.editing.marks
        if marks is None:
            return state
        stands = world_line(self.world, state.metric)
        text = (
            f"The scene is level already: {stands}."
            if marks.world == self.world
            else f"{stands[:1].upper()}{stands[1:]}."
        )
        told = tuple(toast for toast in state.toasts if toast.text != LOOKING)
        after = with_edit(replace(state, toasts=told), "Level the scene", replace(marks, world=self.world))
        after = Notify(text if self.world.sure else f"{UNSURE} {text}", "info").apply(after)
        return FlyTo(poses.make_upright(after.scene.pose, after.up)).apply(after)
