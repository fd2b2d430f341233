"""A scene taken apart by phrases, and who draws it; single files of what it holds: cut-outs, soft masks,
instances, surfaces. `segmented.py` writes a folder of all of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from langflash_core import segments
from langflash_core.base.files import make_folder, staged_folder
from langflash_core.base.outputs import INSTANCES, SOFT, Output
from langflash_core.errors import PromptError
from langflash_core.export import depth, glb
from langflash_core.export.answers import file_names, scaled_box
from langflash_core.export.paint import write_picture
from langflash_core.export.png import write_grey, write_labels
from langflash_core.geometry.fusion import Surface
from langflash_core.surface.fused import fused_rows
from langflash_core.types import Camera, Scene, SegmentedView, Segments
from langflash_core.writing.job import Job, plural
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


def write_parts(job: Job) -> str:
    """A cut-out, a soft mask or an instance map of all phrases together, a picture a camera.

    Raises:
        LangFlashError: nothing answers, or a picture cannot be written.
    """
    cameras = job.cameras()
    targets = job.targets(cameras)
    with job.renderer() as renderer:
        numbers = [None] * len(cameras)
        subject = taken_apart(job.scene, job.prompts, job.request.threshold, cameras, numbers, renderer)
        with staged_folder(job.request.output.parent) as staging:
            seen = False
            for index, view in enumerate(views_of(subject)):
                job.progress("drawing", index / len(cameras))
                _write_part(job.kind, staging / targets[index].name, subject, view)
                seen = seen or bool((view.union >= 0.5).any())
            if not seen:
                where = "this view" if len(cameras) == 1 else "any view"
                raise PromptError(f"not found in {where}: {', '.join(job.prompts)}; choose another --view")
    size = f"{cameras[0].width} x {cameras[0].height}"
    return f"{size}, {plural(len(subject.things), 'instance')} of {plural(len(subject.found), 'phrase')}"


def _write_part(kind: Output, path: Path, subject: Subject, view: SegmentedView) -> None:
    if kind is INSTANCES:
        write_labels(path, view.things, subject.things)
    elif kind is SOFT:
        write_grey(path, view.union, 0.0, 1.0)
    else:
        write_picture(path, cut_out(subject, view, None))


def write_surface(job: Job) -> str:
    """A mesh per phrase, seen from the photos' views.

    Raises:
        LangFlashError: nothing answers, scikit-image is missing, or the file cannot be written.
    """
    output = job.request.output
    with job.renderer() as renderer:
        job.progress("drawing", 0.2)
        subject = taken_apart(job.scene, job.prompts, job.request.threshold, (), (), renderer)
        meshes = surfaces(subject)
    make_folder(output.parent)
    glb.write_surfaces(meshes, output, subject.metres or 1.0)
    faces = sum(len(mesh.faces) for _, mesh in meshes)
    return f"{plural(len(meshes), 'surface')}, {faces:,} triangles"
