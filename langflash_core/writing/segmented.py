"""A folder with every view of a scene taken apart by phrases: per view masks, cut-outs and depth; of all
together boxes, surfaces, a sheet, and a manifest that says in which unit and axes, and by which command."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from torch import Tensor

from langflash_core import __version__
from langflash_core.base.files import staged_folder
from langflash_core.base.request import ExportRequest
from langflash_core.base.running import Progress
from langflash_core.errors import MissingPackageError
from langflash_core.export import depth, glb
from langflash_core.export.colours import label_colours
from langflash_core.export.paint import depth_picture, write_picture
from langflash_core.export.png import to_8bit, write_grey, write_labels, write_mask, write_rgb
from langflash_core.export.sheet import contact_sheet, thumbnail
from langflash_core.types import Camera, SegmentedView
from langflash_core.writing.job import Job, plural
from langflash_core.writing.parts import Subject, boxes, cut_out, surfaces, taken_apart, views_of

_GREY = 0.25  # behind phrases on the sheet
_WIDE = 8  # tiles of a view that fit into a row of their own


def write_segmented(job: Job) -> str:
    """The folder of every photo's view, or of the one that is named.

    Raises:
        LangFlashError: nothing answers, or the folder cannot be written.
    """
    cameras = job.cameras()
    numbers = list(range(len(cameras))) if job.of_photos else [job.choice.view]
    with job.renderer() as renderer:
        subject = taken_apart(job.scene, job.prompts, job.request.threshold, cameras, numbers, renderer)
        return _write_folder(subject, job.request, job.progress)


def _write_folder(subject: Subject, request: ExportRequest, progress: Progress) -> str:
    """All views, boxes, surfaces, contact sheet and manifest, all or none; what was written, in words."""
    with staged_folder(request.output) as staging:
        places = [staging / _folder_name(number) for number in subject.numbers]
        files, tiles, depths = [], [], []
        for index, view in enumerate(views_of(subject)):
            progress("drawing", 0.9 * index / len(places))
            files.append(_write_view(places[index], subject, view))
            tiles += _tiles(subject, view, places[index].name.replace("_", " "))
            depths.append(depth.lengths(view.frame, subject.metres))
        progress("surfaces", 0.9)
        step = depth.fitting_step(max(float(each.max()) for each in depths))
        missing = _write_depths(places, depths, step, subject.unit)
        a_row = len(tiles) // len(places)
        write_picture(staging / "sheet.png", contact_sheet(tiles, a_row if a_row <= _WIDE else None))
        glb.write_boxes(boxes(subject), staging / "boxes.glb")
        missing |= _write_surfaces(staging / "surfaces.glb", subject)
        document = _document(request, subject, files, step, missing)
        text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
        (staging / "manifest.json").write_text(text, encoding="utf-8")
    said = f"{len(subject.found)} of {len(subject.names)} phrases, {plural(len(subject.things), 'instance')}"
    said += f" in {plural(len(places), 'view')}"
    return "; ".join([said, *(f"without {name}: {why}" for name, why in missing.items())])


def _write_view(folder: Path, subject: Subject, view: SegmentedView) -> dict[str, Any]:
    """All of a view but its depth; the names by kind."""
    folder.mkdir()
    write_rgb(folder / "rgb.png", view.frame.rgb)
    write_labels(folder / "labels.png", view.labels, subject.segments.prompts)
    write_labels(folder / "instances.png", view.things, subject.things)
    parts = {
        subject.segments.prompts[p]: _write_part(
            folder, subject.names[p], view.mattes[p], cut_out(subject, view, p)
        )
        for p in subject.found
    }
    return {
        "rgb": "rgb.png",
        "depth": "depth.png",
        "labels": "labels.png",
        "instances": "instances.png",
        "union": _write_part(folder, subject.union_name, view.union, cut_out(subject, view, None)),
        "phrases": parts,
    }


def _write_part(folder: Path, name: str, matte: Tensor, cut: np.ndarray) -> dict[str, str]:
    """Hard mask, soft mask and cut-out."""
    files = {kind: f"{name}_{kind}.png" for kind in ("mask", "soft", "cutout")}
    write_mask(folder / files["mask"], matte >= 0.5)
    write_grey(folder / files["soft"], matte, 0.0, 1.0)
    write_picture(folder / files["cutout"], cut)
    return files


def _write_depths(places: list[Path], depths: list[np.ndarray], step: float, unit: str) -> dict[str, str]:
    """`depth.png`, and `depth.exr` where its package is there; else why not, by name."""
    for folder, lengths in zip(places, depths, strict=True):
        depth.write_depth_png(folder / "depth.png", lengths, step, unit)
    try:
        for folder, lengths in zip(places, depths, strict=True):
            depth.write_depth_exr(folder / "depth.exr", lengths, unit)
    except MissingPackageError as missing:
        return {"depth.exr": str(missing)}
    return {}


def _write_surfaces(path: Path, subject: Subject) -> dict[str, str]:
    """The meshes, where their package is there; else why not, by name."""
    try:
        meshes = surfaces(subject)
    except MissingPackageError as missing:
        return {path.name: str(missing)}
    if not meshes:
        return {path.name: "no view shows a surface of these phrases"}
    glb.write_surfaces(meshes, path, subject.metres or 1.0)
    return {}


def _tiles(subject: Subject, view: SegmentedView, where: str) -> list[tuple[str, np.ndarray]]:
    """Of one view: colours, depth, instances, and each phrase that is there on dark grey."""
    colours = np.concatenate((np.zeros((1, 3), np.uint8), label_colours(len(subject.things))))
    tiles = [
        (where, to_8bit(view.frame.rgb)),
        ("nearness", depth_picture(view.frame)[0]),
        (plural(len(subject.things), "instance"), colours[view.things.cpu().numpy()]),
    ]
    for phrase in subject.found:
        matte = view.mattes[phrase][..., None].cpu()
        lit = matte * view.frame.rgb.cpu().clamp(0, 1) + (1 - matte) * _GREY
        count = subject.segments.counts[phrase]
        tiles.append((subject.segments.prompts[phrase] + (f" ({count})" if count > 1 else ""), to_8bit(lit)))
    return [(caption, thumbnail(picture)) for caption, picture in tiles]


def _folder_name(number: int | None) -> str:
    """Where a view's files are: of a photo by its number as people count, of a camera that was described
    without."""
    return "camera" if number is None else f"photo_{number + 1}"


def _document(
    request: ExportRequest,
    subject: Subject,
    files: Sequence[dict[str, Any]],
    step: float,
    missing: dict[str, str],
) -> dict[str, Any]:
    """The JSON; paths are relative to it.

    Args:
        files: names by kind, one entry a view. step: of depth.png, in the unit. missing: why, by name.
    """
    views = zip(subject.numbers, subject.cameras, files, strict=True)
    return {
        "made_by": f"langflash {__version__}",
        "command": request.line,
        "scene": str(request.scene),
        "backend": subject.renderer.backend,
        "threshold": subject.segments.threshold,
        "unit": subject.unit,
        "axes": "x right, y down, z forward; viewmat maps world to camera, K is in pixels",
        "depth": {
            "depth.png": f"16 bits; depth = value * {step:g}, 0 is nothing",
            "depth.exr": "channel Z, 32-bit floats; depth = value, 0 is nothing",
            "step": step,
            "along": "z, the viewing direction",
        },
        "phrases": _phrases(subject),
        "views": [_view(subject, *view, "depth.exr" not in missing) for view in views],
        "files": {
            kind: name
            for kind, name in (("sheet", "sheet.png"), ("boxes", "boxes.glb"), ("surfaces", "surfaces.glb"))
            if name not in missing
        },
        "left_out": missing,
    }


def _phrases(subject: Subject) -> list[dict[str, Any]]:
    """A phrase and its instances, with the numbers that they have in labels.png and instances.png."""
    parts = subject.segments
    entries = [
        {"id": p + 1, "prompt": prompt, "found": bool(count), "score": score, "instances": []}
        for p, (prompt, count, score) in enumerate(
            zip(parts.prompts, parts.counts, parts.scores, strict=True)
        )
    ]
    for index, ((phrase, number), (name, box)) in enumerate(zip(parts.things, boxes(subject), strict=True)):
        gaussians = int((parts.instances[phrase] == number).sum())
        entry = {"id": index + 1, "name": name, "gaussians": gaussians, "box": box}
        entries[phrase]["instances"].append(entry)
    return entries


def _view(
    subject: Subject, number: int | None, camera: Camera, files: dict[str, Any], exr: bool
) -> dict[str, Any]:
    photos = subject.scene.record.photos
    return {
        "view": None if number is None else number + 1,
        "photo": photos[number] if number is not None and number < len(photos) else None,
        "folder": _folder_name(number),
        "width": camera.width,
        "height": camera.height,
        "viewmat": camera.viewmat.tolist(),
        "K": camera.K.tolist(),
        "orthographic": camera.orthographic,
        "files": {**files, **({"depth_exr": "depth.exr"} if exr else {})},
    }
