"""Single files of what the folder holds: cut-outs, soft masks, instances, depth, surfaces."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from langflash_core.errors import PromptError
from langflash_core.export import depth, glb
from langflash_core.export.png import write_grey, write_labels
from langflash_core.files import make_folder
from langflash_core.types import Camera, Scene, SegmentedView

from ..files import staged_folder
from ..pictures import write_picture
from ..renderers import open_renderer
from ..report import ProgressBar
from .subject import Subject, counted, cut_out, surfaces, taken_apart, views_of


def write_parts(
    args: Namespace, scene: Scene, prompts: list[str], cameras: Sequence[Camera], targets: Sequence[Path]
) -> str:
    """A cut-out, a soft mask or an instance map of all phrases together, a picture a camera.

    Raises:
        LangFlashError: nothing answers, or a picture cannot be written.
    """
    with ProgressBar() as progress, open_renderer(args.backend, fade=args.fade) as renderer:
        numbers = [None] * len(cameras)
        subject = taken_apart(scene, prompts, args.threshold, cameras, numbers, renderer)
        with staged_folder(args.output.parent) as staging:
            seen = False
            for index, view in enumerate(views_of(subject)):
                progress("drawing", index / len(cameras))
                _write_part(args.what, staging / targets[index].name, subject, view)
                seen = seen or bool((view.union >= 0.5).any())
            if not seen:
                where = "this view" if len(cameras) == 1 else "any view"
                raise PromptError(f"not found in {where}: {', '.join(prompts)}; choose another --view")
    size = f"{cameras[0].width} x {cameras[0].height}"
    return f"{size}, {counted(len(subject.things), 'instance')} of {counted(len(subject.found), 'phrase')}"


def _write_part(what: str | None, path: Path, subject: Subject, view: SegmentedView) -> None:
    if what == "instances":
        write_labels(path, view.things, subject.things)
    elif what == "soft":
        write_grey(path, view.union, 0.0, 1.0)
    else:
        write_picture(path, cut_out(subject, view, None))


def write_depth(args: Namespace, scene: Scene, cameras: Sequence[Camera], targets: Sequence[Path]) -> str:
    """Depth of every camera, as EXR or as steps of 16 bits, one step for all.

    Raises:
        LangFlashError: a file cannot be written, or the package for it is missing.
    """
    metres = scene.record.metric_scale
    unit, maps = depth.unit_name(metres), []
    with ProgressBar() as progress, open_renderer(args.backend, fade=args.fade) as renderer:
        for index, camera in enumerate(cameras):
            progress("drawing", index / len(cameras))
            maps.append(depth.lengths(renderer(scene, camera, weight_maps=False), metres))
    longest = max(float(lengths.max()) for lengths in maps)
    step = depth.fitting_step(longest)
    with staged_folder(args.output.parent) as staging:
        for lengths, target in zip(maps, targets, strict=True):
            _write_lengths(staging / target.name, lengths, step, unit)
    size = f"{cameras[0].width} x {cameras[0].height}"
    scale = (
        f"depth = value * {step:g} {_units(unit)}" if args.output.suffix.lower() == ".png" else _units(unit)
    )
    return f"{size}, {scale}, at most {longest:.3g}"


def _units(unit: str) -> str:
    return "m" if unit == "m" else "scene units"


def _write_lengths(path: Path, lengths: np.ndarray, step: float, unit: str) -> None:
    if path.suffix.lower() == ".exr":
        depth.write_depth_exr(path, lengths, unit)
    else:
        depth.write_depth_png(path, lengths, step, unit)


def write_surface(args: Namespace, scene: Scene, prompts: list[str]) -> str:
    """A mesh per phrase, seen from the photos' views.

    Raises:
        LangFlashError: nothing answers, scikit-image is missing, or the file cannot be written.
    """
    with ProgressBar() as progress, open_renderer(args.backend, fade=args.fade) as renderer:
        progress("drawing", 0.2)
        meshes = surfaces(taken_apart(scene, prompts, args.threshold, (), (), renderer))
    make_folder(args.output.parent)
    glb.write_surfaces(meshes, args.output, scene.record.metric_scale or 1.0)
    faces = sum(len(mesh.faces) for _, mesh in meshes)
    return f"{counted(len(meshes), 'surface')}, {faces:,} triangles"
