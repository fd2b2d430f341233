"""Values that go between the viewport and whoever draws its scene."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from langflash_core.geometry.poses import START, Pose

from ..governor import Kind, Plan
from ..state import State

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery
    from langflash_core.types import Camera, Frame

BACKGROUND = (0.055, 0.06, 0.07)  # the theme's canvas


@dataclass(frozen=True)
class Stand:
    """Where the picture is looked at from. size: of its place, framebuffer pixels. moved: when pose, size or
    a thing under a hand changed last, on the clock of `State.now`."""

    pose: Pose = START
    size: tuple[int, int] = (0, 0)
    moved: float = 0.0


@dataclass(frozen=True)
class Drawn:
    """A picture's name: another value, another picture. size: of its place. marked: how often edits were
    brought to the scene before."""

    serial: int
    pose: Pose
    size: tuple[int, int]
    plan: Plan
    marked: int

    def at(self, kind: Kind, scale: float) -> "Drawn":
        """The same seen in another plan."""
        return replace(self, plan=Plan(kind, scale))

    def covers(self, wanted: "Drawn") -> bool:
        """Whether it shows at least what is wanted."""
        return self == replace(wanted, plan=self.plan) and self.plan.covers(wanted.plan)


@dataclass(frozen=True)
class Asked:
    """The prompts `keys`, in the order of `query`, compiled at this `Asking.revision`; none without a
    query. number: names the question."""

    keys: tuple[int, ...] = ()
    query: "CompiledQuery | None" = None
    revision: int = 0
    number: int = 0


@dataclass(frozen=True)
class View:
    """A picture at rest, read back for the worker to score. revision: as `Asking` has it. others: relevance
    (R, H, W) of what the phrases relate their heads to. up: of the scene, a unit vector. name: of the picture
    and the question; cuts: thresholds in force.
    """

    serial: int
    keys: tuple[int, ...]
    frame: "Frame"
    relevance: "Tensor"
    camera: "Camera"
    query: "CompiledQuery"
    revision: int
    others: "Tensor | None" = None
    up: tuple[float, ...] = (0.0, -1.0, 0.0)
    name: tuple = ()
    cuts: tuple[float, ...] = ()


@dataclass(frozen=True)
class Numbers:
    """Of a picture at rest: its frame, relevance (P, H, W), and as `View.others`."""

    frame: "Frame"
    relevance: "Tensor"
    others: "Tensor | None" = None


def kind_of(state: State) -> Kind:
    """What a picture must hold to show what is wanted while the camera moves."""
    if not state.wants_maps or state.scene.info is None or state.scene.info.num_atoms == 0:
        return Kind.COLOUR
    return Kind.MAPS if state.scene.mode.maps else Kind.FAST
