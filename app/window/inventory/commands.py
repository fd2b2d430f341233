"""What can happen to the inventory: it is shown and filled, its things are named, chosen and flown to."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from langflash_core.base.records import Guess
from langflash_core.geometry import poses
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene import edits
from langflash_core.scene.edits import Combine

from ..editing.commands import with_edit
from ..scene.camera import FlyTo
from ..state import State
from .state import Row

ROOM = 1.5
"""Of a thing's box, that is shown of the room where one flies to it."""
AROUND = 1.15
"""The same, where a panel covers a part of the picture, of the box's width."""
NEAREST = 0.55
"""Of the way between a photo and a thing: what is seen nearer than that falls apart."""
LONGEST_NAME = 60


@dataclass(frozen=True)
class ShowInventory:
    """The panel, or no longer; what it lists is looked for once it is there."""

    open: bool

    def apply(self, state: State) -> State:
        return state.with_listing(open=self.open, chosen=state.listing.chosen if self.open else "")


@dataclass(frozen=True)
class Looking:
    """The worker looks for things."""

    def apply(self, state: State) -> State:
        return state.with_listing(looking=True, problem="")


@dataclass(frozen=True)
class Listed:
    """What is there."""

    rows: tuple[Row, ...]
    unit: str
    guess: Guess | None

    def apply(self, state: State) -> State:
        after = state.with_listing(
            looking=False, rows=self.rows, unit=self.unit, guess=self.guess, problem=""
        )
        return after if after.listing.row(state.listing.chosen) else after.with_listing(chosen="")


@dataclass(frozen=True)
class NotListed:
    """Why there is no list."""

    sentence: str

    def apply(self, state: State) -> State:
        return state.with_listing(looking=False, rows=(), problem=self.sentence, chosen="")


@dataclass(frozen=True)
class NameThing:
    """A person's own name of a thing; an empty one takes it back."""

    id: str
    name: str

    def apply(self, state: State) -> State:
        marks, name = state.editing.marks, " ".join(self.name.split())[:LONGEST_NAME]
        if marks is None:
            return state
        names = {**marks.thing_names, self.id: "" if name == self.id else name}
        kept = {id: own for id, own in names.items() if own}
        return with_edit(state, f"Name {self.id}", replace(marks, thing_names=kept))


@dataclass(frozen=True)
class ChooseThing:
    """Select a thing and fly to where a photo showed it best. picture: width and height of the picture, and
    how much of its right side is covered, pixels."""

    id: str
    combine: Combine = "replace"
    picture: tuple[float, float, float] = (1.0, 1.0, 0.0)

    def apply(self, state: State) -> State:
        row, marks = state.listing.row(self.id), state.editing.marks
        if row is None or marks is None or row.rows.count != marks.deleted.count:
            return state
        verb = {"replace": "Select", "add": "Add", "remove": "Unselect"}[self.combine]
        after = with_edit(state, f"{verb} {self.id}", edits.select(marks, row.rows, self.combine))
        there = aside(seen_best(after, row), row.corners, *self.picture)
        return FlyTo(there).apply(after.with_listing(chosen=self.id))


def seen_best(state: State, row: Row) -> Pose:
    """As the photo that shows it best saw it, nearer, so that it fills the picture; as it is seen now where
    no photo did."""
    info, low, high = state.scene.info, row.corners.min(0), row.corners.max(0)
    middle = (low + high) / 2
    views = [info.views[view] for view in row.photos if view < len(info.views)] if info is not None else []
    start = poses.make_upright(views[0] if views else state.scene.pose, state.up)
    way = middle - np.array(start.centre)
    forward = (
        Vector(*way.tolist()) if views and float(way @ way) > 1e-12 else Vector(*start.axes[:, 2].tolist())
    )
    half = ROOM * (high - low) / 2
    there = poses.framing(
        poses.facing(start, forward, state.up),
        Vector(*(middle - half).tolist()),
        Vector(*(middle + half).tolist()),
    )
    nearest = NEAREST * float(way @ way) ** 0.5
    return poses.zoom(there, max(1.0, nearest / there.reach)) if views and there.span is None else there


def aside(pose: Pose, corners: Float[np.ndarray, "8 3"], width: float, height: float, covered: float) -> Pose:
    """The pose with its pivot in the middle of what is not covered of the picture, pixels, and so far away
    that the box's corners (8, 3) fit in there."""
    share = min(covered / max(width, 1.0), 0.6)
    found = poses.project(corners, pose, (width, height))
    wide = width if found is None else float(np.ptp(found[1][:, 0]))
    away = poses.zoom(pose, max(1.0, AROUND * wide / ((1 - share) * width)))
    unit = poses.units_per_pixel(away, max(round(width), 1), max(round(height), 1))
    return poses.pan(away, share * width / 2 * unit, 0.0)
