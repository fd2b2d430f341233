"""What can happen to a thing that was clicked: less and more of it, and the line around what is selected."""

from dataclasses import dataclass, replace

from langflash_core.scene import edits
from langflash_core.scene.edits import Combine
from langflash_core.scene.mask import Mask

from ..state import State
from .commands import selected
from .state import Outline, Reached


@dataclass(frozen=True)
class Searched:
    """How much of the scene was searched for things, of 1."""

    share: float

    def apply(self, state: State) -> State:
        return state.with_editing(searched=self.share)


@dataclass(frozen=True)
class ThingFound:
    """What a click can mean, the smallest first, and which of it is one thing."""

    levels: tuple[Mask, ...]
    chosen: int
    combine: Combine

    def apply(self, state: State) -> State:
        state, history = state.with_editing(waiting=""), state.editing.history
        if history is None or self.levels[self.chosen].count != history.marks.deleted.count:
            return state
        return _shown(state, Reached(self.levels, self.chosen, self.combine, history, history))


@dataclass(frozen=True)
class SetLevel:
    """Select less or more of what was clicked last, in place of what the click selected."""

    level: int

    def apply(self, state: State) -> State:
        reached = state.editing.reached
        if reached is None:
            return state
        level = min(max(self.level, 0), len(reached.levels) - 1)
        return state if level == reached.level else _shown(state, replace(reached, level=level))


@dataclass(frozen=True)
class StepLevel:
    """So many levels more, or less."""

    steps: int

    def apply(self, state: State) -> State:
        reached = state.editing.reached
        return state if reached is None else SetLevel(reached.level + self.steps).apply(state)


@dataclass(frozen=True)
class Outlined:
    """The line around the selection."""

    outline: Outline

    def apply(self, state: State) -> State:
        return state.with_editing(outline=self.outline)


def _shown(state: State, reached: Reached) -> State:
    """With that level selected, as the one edit that the click was."""
    before = reached.before
    after = edits.select(before.marks, reached.levels[reached.level], reached.combine)
    state = selected(state.with_editing(history=before), after, reached.combine, "of a thing")
    assert state.editing.history is not None
    return state.with_editing(clicked=replace(reached, after=state.editing.history))
