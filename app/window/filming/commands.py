"""What can happen to the camera's path."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from langflash_core.geometry.poses import Pose

from ..commands import Notify
from ..editing.commands import with_edit
from ..state import State
from .state import MOST_KEYS, Tour, stored


@dataclass(frozen=True)
class AddKey:
    """The present view is the next key frame."""

    def apply(self, state: State) -> State:
        if state.scene.info is None:
            return state
        if len(state.keys) >= MOST_KEYS:
            text = f"A camera path has at most {MOST_KEYS} key frames; remove one before you add another."
            return Notify(text).apply(state)
        return _with_keys(state, f"Key frame {len(state.keys) + 1}", (*state.keys, state.scene.pose))


@dataclass(frozen=True)
class RemoveKey:
    """One key frame less; the last one unless told otherwise."""

    place: int = -1

    def apply(self, state: State) -> State:
        keys = list(state.keys)
        if not -len(keys) <= self.place < len(keys):
            return state
        label = f"Remove key frame {self.place % len(keys) + 1}"
        del keys[self.place]
        return _with_keys(state, label, keys).with_filming(tour=None)


@dataclass(frozen=True)
class ClearKeys:
    """No key frames."""

    def apply(self, state: State) -> State:
        return _with_keys(state, "Remove all key frames", ()).with_filming(tour=None)


@dataclass(frozen=True)
class Preview:
    """Fly along the key frames, as a film would."""

    def apply(self, state: State) -> State:
        if len(state.keys) < 2:
            text = "A camera path needs two or more key frames; fly somewhere and add one (M)."
            return Notify(text, "info").apply(state)
        return state


@dataclass(frozen=True)
class TourReady:
    """The way along these key frames."""

    keys: tuple[Pose, ...]
    poses: tuple[Pose, ...]
    seconds: float

    def apply(self, state: State) -> State:
        if self.keys != state.keys:
            return state
        return state.with_filming(tour=Tour(self.poses, self.seconds, state.now)).with_scene(
            flight=None, view=None
        )


@dataclass(frozen=True)
class StopTour:
    """Stay where the flight is."""

    def apply(self, state: State) -> State:
        return state.with_filming(tour=None)


def _with_keys(state: State, label: str, keys: Sequence[Pose]) -> State:
    """Other key frames, as an edit."""
    marks = state.editing.marks
    return state if marks is None else with_edit(state, label, replace(marks, camera_path=stored(keys)))
