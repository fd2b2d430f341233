"""What can happen to the picture: its mode, the pose it is seen from, the photo beside it."""

from dataclasses import dataclass, replace

import numpy as np

from langflash_core.base.pictures import Picture
from langflash_core.geometry import poses
from langflash_core.geometry.poses import Pose, Vector

from ..commands import Notify
from ..editing.state import Point
from ..state import State
from .near import at_photo, first_stand, middle_of_near, orbited, places_to_keep_to
from .state import Flight, Hold


@dataclass(frozen=True)
class SetMode:
    """What the picture shows."""

    mode: Picture

    def apply(self, state: State) -> State:
        return state.with_scene(mode=self.mode)


@dataclass(frozen=True)
class JumpTo:
    """Fly to input view `view`."""

    view: int

    def apply(self, state: State) -> State:
        if state.scene.info is None or not 0 <= self.view < len(state.scene.info.views):
            return state
        flight = Flight(state.scene.pose, state.scene.info.views[self.view], state.now)
        return state.with_scene(flight=flight, view=self.view).with_filming(tour=None)


@dataclass(frozen=True)
class FlyTo:
    """Fly to a pose that is no photo's."""

    pose: Pose

    def apply(self, state: State) -> State:
        return state.with_scene(
            flight=Flight(state.scene.pose, self.pose, state.now), view=None
        ).with_filming(tour=None)


@dataclass(frozen=True)
class Face:
    """Fly around the pivot until the picture looks along an axis of the world that the scene stands in, or as
    near to that as the photos saw it from. forward: one of `SIDES`."""

    forward: Vector

    def apply(self, state: State) -> State:
        forward, start = aimed(state, self.forward), state.scene.pose
        if state.world is not None and abs(self.forward.y) > 0.5:  # a plan stands along the walls
            start = poses.facing(start, _nearest_wall(state), state.up)
        pose = poses.facing_near(start, forward, places_to_keep_to(state), state.up)
        if pose != poses.facing(start, forward, state.up):
            state = Notify(NOT_SEEN, "info").apply(state)
        return FlyTo(pose).apply(state)


def aimed(state: State, direction: Vector) -> Vector:
    """A direction of the world that the scene stands in (east, down, north), in the scene's own axes."""
    return Vector(*(np.array(direction) @ state.turn).tolist())


def _nearest_wall(state: State) -> Vector:
    """The level axis of the world with which the picture turns least."""
    right = state.turn @ state.scene.pose.axes[:, 0]
    sides = (Vector(0, 0, 1), Vector(0, 0, -1), Vector(1, 0, 0), Vector(-1, 0, 0))
    # Looking along (x, 0, z), the picture's right side is at (z, 0, -x).
    return aimed(state, max(sides, key=lambda side: side.z * right[0] - side.x * right[2]))


@dataclass(frozen=True)
class SwitchRays:
    """Parallel rays (orthographic) for perspective, and back; what is looked at stays as large."""

    def apply(self, state: State) -> State:
        info = state.scene.info
        if info is None:
            return state
        there = state.scene.flight.end if state.scene.flight else state.scene.pose
        if there.span is not None:
            switched = poses.perspective(there)
        else:
            at = Vector(*there.pivot.tolist())
            switched = poses.orthographic(there, *(info.extent or (at, at)))
        return FlyTo(switched).apply(state) if state.scene.flight else MoveTo(switched).apply(state)


NOT_SEEN = (
    "No photo was taken from there, so the view stops here. To go further, use parallel rays (comma), "
    'or switch off "Stay near the photos" (Preferences).'
)


SIDES = (
    ("the front", Vector(0.0, 0.0, 1.0)),
    ("the back", Vector(0.0, 0.0, -1.0)),
    ("the left", Vector(1.0, 0.0, 0.0)),
    ("the right", Vector(-1.0, 0.0, 0.0)),
    ("above", Vector(0.0, 1.0, 0.0)),
    ("below", Vector(0.0, -1.0, 0.0)),
)
"""Where one may look from, with the direction in which, of the world that the scene stands in; the front is
the first photo's side."""


@dataclass(frozen=True)
class Home:
    """Fly back to where the scene opened: to the first photo's view, upright."""

    def apply(self, state: State) -> State:
        info = state.scene.info
        if info is None or not info.views:
            return state
        there = first_stand(info, state.world)
        return JumpTo(0).apply(state) if there == info.views[0] else FlyTo(there).apply(state)


@dataclass(frozen=True)
class MoveTo:
    """Stand at `pose`: a step of an orbit, pan, zoom or fly. Ends a flight."""

    pose: Pose

    def apply(self, state: State) -> State:
        return state.with_scene(pose=self.pose, flight=None, view=None).with_filming(tour=None)


@dataclass(frozen=True)
class Orbit:
    """A step around what is looked at, radians; held as `near.held` has it."""

    yaw: float = 0.0
    pitch: float = 0.0

    def apply(self, state: State) -> State:
        return MoveTo(orbited(state, state.scene.pose, self.yaw, self.pitch)[0]).apply(state)


@dataclass(frozen=True)
class TakeHold:
    """A hand presses on a pixel of the picture's place, framebuffer pixels. Where a photo was taken it looks
    around; elsewhere, and where it `orbits`, it turns around what is under it, or else what is near."""

    at: Point
    orbits: bool = False

    def apply(self, state: State) -> State:
        looks = not self.orbits and at_photo(state)
        return state.with_scene(hold=Hold(looks, middle_of_near(state)))


@dataclass(frozen=True)
class HoldPlace:
    """What is under the hand, of the scene."""

    place: Vector

    def apply(self, state: State) -> State:
        hold = state.scene.hold
        return state if hold is None else state.with_scene(hold=replace(hold, pivot=self.place))


@dataclass(frozen=True)
class Pull:
    """A drag: stand at `pose`. refused: design pixels of it that went in vain."""

    pose: Pose
    refused: float = 0.0

    def apply(self, state: State) -> State:
        hold = state.scene.hold or Hold()
        state = MoveTo(self.pose).apply(state)
        return state.with_scene(hold=replace(hold, refused=hold.refused + self.refused))


@dataclass(frozen=True)
class LetGo:
    """The hand leaves the picture."""

    def apply(self, state: State) -> State:
        return state.with_scene(hold=None)


@dataclass(frozen=True)
class SetFov:
    """Another field of view, degrees."""

    degrees: float

    def apply(self, state: State) -> State:
        return MoveTo(poses.with_fov(state.scene.pose, self.degrees)).apply(state)


@dataclass(frozen=True)
class FrameAll:
    """Fly back until the whole scene is in view, looking the same way."""

    def apply(self, state: State) -> State:
        info = state.scene.info
        if info is None or info.extent is None:
            return state
        return FlyTo(poses.framing(state.scene.pose, *info.extent)).apply(state)


@dataclass(frozen=True)
class Compare:
    """The photo of the view on show from `place` (0 to 1) on to the right; None: no photo."""

    place: float | None

    def apply(self, state: State) -> State:
        place = None if self.place is None else min(max(self.place, 0.0), 1.0)
        return state.with_scene(compare=place)
