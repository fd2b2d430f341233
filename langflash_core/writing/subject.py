"""A scene taken apart by phrases, and who draws it: what pictures, meshes and the manifest are made of."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from langflash_core import segments
from langflash_core.errors import PromptError
from langflash_core.export import depth
from langflash_core.export.answers import file_names, scaled_box
from langflash_core.geometry.fusion import Surface
from langflash_core.surface.fused import fused_rows
from langflash_core.types import Camera, Scene, SegmentedView, Segments
from langflash_core.writing.renderers import Renderer

MOST = 255  # phrases or instances: a palette's colours
_SURFACE_SIDE = 512  # pixels of the depths that a surface is fused from


@dataclass(frozen=True)
class Subject:
    """What is taken apart, seen by these cameras; `numbers` are the photos', None for a described camera."""

    scene: Scene
    segments: Segments
    cameras: Sequence[Camera]
    numbers: Sequence[int | None]
    renderer: Renderer

    @property
    def found(self) -> list[int]:
        """Phrases that are there."""
        return [phrase for phrase, count in enumerate(self.segments.counts) if count]

    @cached_property
    def _file_names(self) -> list[str]:
        return file_names(["union", *self.segments.prompts])

    @property
    def names(self) -> list[str]:
        """A safe name per phrase, none of them `union_name`."""
        return self._file_names[1:]

    @property
    def union_name(self) -> str:
        """Of all phrases together."""
        return self._file_names[0]

    @property
    def things(self) -> list[str]:
        """What each instance is called."""
        return [f"{self.segments.prompts[phrase]} {number}" for phrase, number in self.segments.things]

    @property
    def metres(self) -> float | None:
        """Metres per scene unit, where known."""
        return self.scene.record.metric_scale

    @property
    def unit(self) -> str:
        """Of lengths that are written."""
        return depth.unit_name(self.metres)


def taken_apart(
    scene: Scene,
    prompts: Sequence[str],
    threshold: float | None,
    cameras: Sequence[Camera],
    numbers: Sequence[int | None],
    renderer: Renderer,
) -> Subject:
    """Raises PromptError: nothing in the scene answers, or it finds more than a palette has colours."""
    found = segments.segment(scene, prompts, threshold=threshold)
    if not found.things:
        raise PromptError(
            f"not found in the scene: {', '.join(found.prompts)} (best score {max(found.scores):.3f}, "
            f"threshold {found.threshold:.3f}); lower --threshold"
        )
    if max(len(found.things), len(prompts)) > MOST:
        raise PromptError(
            f"{len(prompts)} phrases find {len(found.things)} instances, over {MOST}; ask fewer"
        )
    return Subject(scene, found, cameras, numbers, renderer)


def views_of(subject: Subject) -> Iterator[SegmentedView]:
    """One camera after the other."""
    carrying = segments.carrying(subject.scene, subject.segments)
    for camera in subject.cameras:
        yield segments.segmented_view(carrying, subject.segments, camera, subject.renderer)


def cut_out(subject: Subject, view: SegmentedView, phrase: int | None) -> np.ndarray:
    """(H, W, 4) uint8 of a phrase, or of all together."""
    members = subject.segments.members
    chosen, matte = (members.any(0), view.union) if phrase is None else (members[phrase], view.mattes[phrase])
    cut = segments.cut_out(subject.scene, chosen, view.camera, matte, subject.renderer)
    return (cut * 255).round().byte().cpu().numpy()


def boxes(subject: Subject) -> list[tuple[str, dict[str, Any]]]:
    """Name and oriented box of every instance, in the unit that is written."""
    found = segments.boxes(subject.scene, subject.segments)
    return list(zip(subject.things, (scaled_box(box, subject.metres or 1.0) for box in found), strict=True))


def surfaces(subject: Subject) -> list[tuple[str, Surface]]:
    """A mesh per phrase that some photo's view shows, of the scene as one surface.

    Raises:
        MissingPackageError: scikit-image is not installed.
    """
    parts, scene, members = subject.segments, subject.scene, subject.segments.members
    if scene.layered:
        rows = fused_rows(scene).cpu()
        scene, members = scene.rows(rows).with_record(layered=False), members[:, rows]
    ratio = _SURFACE_SIDE / max(scene.view_size)
    width, height = (max(1, round(ratio * side)) for side in scene.view_size)
    cameras = [scene.camera(view, width, height) for view in range(scene.num_views)]
    meshes = [
        (parts.prompts[p], segments.surface(scene, members[p], cameras, subject.renderer))
        for p in subject.found
    ]
    return [(name, mesh) for name, mesh in meshes if mesh is not None]


def plural(number: int, what: str) -> str:
    """`1 view`, `2 views`."""
    return f"{number} {what}{'s' * (number != 1)}"
