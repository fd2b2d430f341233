"""What can happen with the tool in hand, and what is found where it points."""

from dataclasses import dataclass, replace

import numpy as np

from langflash_core.geometry import poses
from langflash_core.geometry.poses import Vector
from langflash_core.scene.edits import Combine

from ..asking.commands import with_heat, with_prompt
from ..asking.state import Prompt, free_colour
from ..scene.state import Flight
from ..state import State
from .commands import with_edit
from .state import RADIUS_RANGE, REACH_RANGE, Card, Point, Reading, Spot, Tool

LIKE_THIS = "like this"
LIKE_THRESHOLD = 0.97  # relevancy; a look at one spot is sharper than a word


# The tool in hand


@dataclass(frozen=True)
class SetTool:
    """Take another tool; what the last one was doing ends."""

    tool: Tool

    def apply(self, state: State) -> State:
        state = state.with_editing(tool=self.tool, drag=(), hover=None, asked=None, card=None, ruler=())
        return state.with_editing(gesture=None, tint=None)


@dataclass(frozen=True)
class SetCombine:
    """Whether a selection replaces, adds or removes without a modifier key."""

    combine: Combine

    def apply(self, state: State) -> State:
        return state.with_editing(combine=self.combine)


@dataclass(frozen=True)
class SetRadius:
    """Another brush, design pixels."""

    radius: float

    def apply(self, state: State) -> State:
        return state.with_editing(radius=min(max(self.radius, RADIUS_RANGE[0]), RADIUS_RANGE[1]))


@dataclass(frozen=True)
class SetThrough:
    """Whether regions select what is hidden behind other things, too."""

    through: bool

    def apply(self, state: State) -> State:
        return state.with_editing(through=self.through)


@dataclass(frozen=True)
class SetReach:
    """How far growing goes, in spacings of the Gaussians."""

    reach: float

    def apply(self, state: State) -> State:
        return state.with_editing(reach=min(max(self.reach, REACH_RANGE[0]), REACH_RANGE[1]))


@dataclass(frozen=True)
class Drag:
    """The region being drawn; an empty one ends it."""

    points: tuple[Point, ...]

    def apply(self, state: State) -> State:
        return state.with_editing(drag=self.points)


# Pointing


@dataclass(frozen=True)
class Hover:
    """The pointer is at a pixel of the picture's place, framebuffer pixels; None: it left."""

    at: Point | None

    def apply(self, state: State) -> State:
        hover = None if self.at is None else Reading(self.at)
        return state.with_editing(hover=hover)


@dataclass(frozen=True)
class ReadingTaken:
    """What the pixel under the pointer shows."""

    reading: Reading

    def apply(self, state: State) -> State:
        hover = state.editing.hover
        if hover is None or hover.at != self.reading.at:
            return state
        return state.with_editing(hover=self.reading)


@dataclass(frozen=True)
class Ask:
    """What is this, at a pixel?"""

    at: Point

    def apply(self, state: State) -> State:
        return state.with_editing(asked=self.at, card=None)


@dataclass(frozen=True)
class CardOpened:
    """The place is read; its words follow."""

    reading: Reading

    def apply(self, state: State) -> State:
        return state.with_editing(asked=None, card=Card(self.reading))


@dataclass(frozen=True)
class RulerPlaced:
    """One end of what is measured; after both a new one begins."""

    reading: Reading

    def apply(self, state: State) -> State:
        ends, place = state.editing.ruler, self.reading.point
        if place is None:
            return state.with_editing(asked=None)
        return state.with_editing(asked=None, ruler=(place,) if len(ends) != 1 else (*ends, place))


@dataclass(frozen=True)
class ClearRuler:
    """Measure nothing."""

    def apply(self, state: State) -> State:
        return state.with_editing(ruler=(), asked=None)


@dataclass(frozen=True)
class SetLength:
    """What is measured is so many metres long: the scene has a scale."""

    metres: float

    def apply(self, state: State) -> State:
        length = measured(state.editing.ruler)
        marks = state.editing.marks
        if marks is None or not length or not LENGTHS[0] <= self.metres <= LENGTHS[1]:
            return state
        label = f"This is {100 * self.metres:.4g} cm"
        return with_edit(state, label, replace(marks, metric_scale=self.metres / length))


LENGTHS = (0.001, 1000.0)  # metres


def measured(ends: tuple[Spot, ...]) -> float | None:
    """Scene units between both ends; None before there are two."""
    return float(np.linalg.norm(np.subtract(*ends))) if len(ends) == 2 else None


@dataclass(frozen=True)
class Named:
    """Nearest words (word, score) and language vector of the place that was asked about."""

    asked: Reading
    reading: Reading
    words: tuple[tuple[str, float], ...]
    vector: bytes

    def apply(self, state: State) -> State:
        card = state.editing.card
        if card is None or card.reading != self.asked:
            return state
        return state.with_editing(card=Card(self.reading, self.words, self.vector))


@dataclass(frozen=True)
class CloseCard:
    """Take the answer away."""

    def apply(self, state: State) -> State:
        return state.with_editing(card=None, asked=None)


@dataclass(frozen=True)
class AtomsNamed:
    """The nearest words of every atom, and those of the nearest that some photo answers."""

    names: tuple[tuple[str, ...], ...]
    found: tuple[str, ...] = ()

    def apply(self, state: State) -> State:
        return state.with_editing(names=self.names, found=self.found)


@dataclass(frozen=True)
class FindSimilar:
    """Ask for what the card's place says, as a prompt of its own."""

    def apply(self, state: State) -> State:
        card = state.editing.card
        if card is None or not card.vector:
            return state
        word = card.words[0][0] if card.words else ""
        text = f"{LIKE_THIS} ({word})" if word else LIKE_THIS
        empty = next((p for p in state.asking.prompts if not p.text.strip()), None)
        others = tuple(p for p in state.asking.prompts if p is not empty)
        prompt = Prompt(state.next_key, text, free_colour(others), LIKE_THRESHOLD, like=card.vector)
        return with_heat(with_prompt(state, others, prompt)).with_editing(card=None)


@dataclass(frozen=True)
class FrameSelection:
    """Fly to where the selection, or everything where nothing is selected, fills the view."""

    def apply(self, state: State) -> State:
        marks = state.editing.marks
        if marks is None or state.scene.info is None:
            return state
        rows = (marks.selected or marks.visible).rows()
        points = state.scene.info.memory.changed(marks).gaussians.means.numpy()[rows]
        if not len(points):
            return state
        low, high = np.quantile(points, (0.02, 0.98), axis=0)
        pose = poses.framing(state.scene.pose, Vector(*low.tolist()), Vector(*high.tolist()))
        return state.with_scene(flight=Flight(state.scene.pose, pose, state.now), view=None)
