"""The manifest: what the folder holds, in which unit and axes, and the command that makes it again."""

from collections.abc import Sequence
from typing import Any

from langflash_core import __version__
from langflash_core.base.request import ExportRequest
from langflash_core.types import Camera
from langflash_core.writing.subject import Subject, boxes


def folder_name(number: int | None) -> str:
    """Where a view's files are: of a photo by its number as people count, of a camera that was described
    without."""
    return "camera" if number is None else f"photo_{number + 1}"


def document(
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
        "folder": folder_name(number),
        "width": camera.width,
        "height": camera.height,
        "viewmat": camera.viewmat.tolist(),
        "K": camera.K.tolist(),
        "orthographic": camera.orthographic,
        "files": {**files, **({"depth_exr": "depth.exr"} if exr else {})},
    }
