"""The worker's side of mending: jobs that make another scene of the one on show.

Heavy imports wait until they are needed.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from langflash_core.errors import Cancelled
from langflash_core.geometry.poses import Pose, to_camera
from langflash_core.scene.mask import Mask

from ..editing.mending import HiddenForGood
from ..editing.state import Region, Spot
from ..requests import Asked
from .merging import Merged
from .state import SceneInfo
from .work import OnShow, describe_scene

if TYPE_CHECKING:
    from langflash_core.mending.cloning import Stroke
    from langflash_core.types import Frame, Scene

MOST_SIDE = 720  # pixels of the picture that a brush is looked at in


@dataclass(frozen=True)
class FillHole(OnShow):
    """The selection taken away with what runs over its edge, and the hole filled from what is around."""

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> Merged:
        import torch

        from langflash_core.mending.filling import delete_and_fill
        from langflash_core.mending.looks import draw_scene
        from langflash_core.scene.edited import there

        progress("looking", 0.1)
        own, marks = self.info, self.marks
        kept = marks.left.rows()[: marks.there[0]]
        shown = there(own.memory.changed(marks), marks).rows(torch.from_numpy(kept))
        render = _watched(draw_scene, progress, cancelled)
        members = torch.from_numpy(marks.selected.rows()[: len(kept)][kept])
        filled, rows = delete_and_fill(shown, members, render), np.zeros(marks.selected.count, bool)
        rows[np.flatnonzero(kept)] = filled.gone.numpy()
        taken, info = Mask.of(rows), _with_part(self, filled.patch, serial)
        beyond = len(taken - marks.selected)
        return Merged(own.serial, marks.there, info, own.name, taken, beyond=beyond, unseen=filled.unseen)


@dataclass(frozen=True)
class CopyPart(OnShow):
    """The selection as it is shown, once more, in its own place: to be moved over what it is to cover."""

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> Merged:
        import torch

        own, marks = self.info, self.marks
        chosen = torch.from_numpy(np.flatnonzero(marks.selected.rows()))
        copies = own.memory.changed(marks).rows(chosen)
        return Merged(own.serial, marks.there, _with_part(self, copies, serial), own.name, copied=True)


@dataclass(frozen=True)
class ClonePart(OnShow):
    """What lies round `source`, laid where a brush went over the picture's place, which has `size`."""

    source: Spot
    region: Region
    pose: Pose
    size: tuple[int, int]
    fit: bool

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> Merged:
        import torch

        from langflash_core.mending.cloning import clone
        from langflash_core.mending.looks import draw_scene
        from langflash_core.scene.edited import there

        progress("looking", 0.1)
        own, marks = self.info, self.marks
        visible = torch.from_numpy(marks.visible.rows()[: marks.there[0]])
        shown = there(own.memory.changed(marks), marks)
        render = _watched(draw_scene, progress, cancelled)
        copies, gone = clone(shown, visible, self.source, self._stroke(), render, fit=self.fit)
        rows = np.zeros(marks.selected.count, bool)
        rows[: len(gone)] = gone.numpy()
        info = _with_part(self, copies, serial)
        return Merged(own.serial, marks.there, info, own.name, Mask.of(rows), copied=True)

    def _stroke(self) -> "Stroke":
        """As the library takes it, of a coarser picture where this one is large."""
        from langflash_core.mending.cloning import Stroke

        scale = min(1.0, MOST_SIDE / max(self.size))
        width, height = (max(1, round(side * scale)) for side in self.size)
        x, y = self.region.points[0]
        radius = scale * (self.region.radius or 0.0)
        pixels = self.region.pixels(width, height, scale)
        return Stroke(to_camera(self.pose, width, height), pixels, (scale * x, scale * y), radius)


@dataclass(frozen=True)
class SplitPart(OnShow):
    """A part of an answer with an atom of its own, which is denied the phrase."""

    rows: Mask = field(repr=False)
    text: str

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> Merged:
        import torch

        from langflash_core.scene.edited import there
        from langflash_core.scene.lone import with_lone_part

        own, marks = self.info, self.marks
        scene, shown = there(own.scene, marks), there(own.memory.changed(marks), marks)
        part = torch.from_numpy(self.rows.rows()[: len(scene.gaussians)])
        info = describe_scene(with_lone_part(scene, part, shown), serial, own.name, own.path)
        return Merged(own.serial, marks.there, info, own.name, self.rows, denied=self.text)


@dataclass(frozen=True)
class HidePart(OnShow):
    """The scene as edited, with the selection hidden for good in Gaussians and photos."""

    how: str
    margin: float

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> HiddenForGood:
        import torch

        from langflash_core.mending.hiding import Hiding, hide
        from langflash_core.mending.looks import draw_scene
        from langflash_core.scene.edited import edited_scene

        progress("looking", 0.1)
        own, marks = self.info, self.marks
        scene = edited_scene(own.scene, marks)
        members = torch.from_numpy(marks.selected.rows()[marks.left.rows()])
        render = _watched(draw_scene, progress, cancelled)
        done, report = hide(scene, members, render, Hiding(self.how, margin=self.margin))  # type: ignore[arg-type]
        count = report.members + report.rim
        photos = f", {len(report.photos)} photos painted over" if report.photos else ""
        still = "" if own.path is None else f" {own.path.name} on the disk still shows it."
        said = f"Hidden: {count:,} Gaussians{photos}. Ctrl+Z brings it back until this is saved.{still}"
        return HiddenForGood(own.serial, marks, describe_scene(done, serial, own.name), said)


def _with_part(job: OnShow, part: "Scene", serial: int) -> SceneInfo:
    """The scene as far as it is there, and a part behind it."""
    from langflash_core.scene.edited import there
    from langflash_core.scene.joining import append_part

    own = job.info
    return describe_scene(append_part(there(own.scene, job.marks), part), serial, own.name, own.path)


def _watched(
    render: "Callable[..., Frame]", progress: Callable[[str, float], None], cancelled: Asked
) -> "Callable[..., Frame]":
    """Who draws, between whose pictures a job can end."""
    made = itertools.count(1)

    def drawn(*args, **kwargs) -> "Frame":
        if cancelled():
            raise Cancelled("stopped")
        progress("drawing", 1 - 0.9 ** next(made))
        return render(*args, **kwargs)

    return drawn
