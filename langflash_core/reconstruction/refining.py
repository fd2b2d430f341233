"""A scene fitted to its photos for some seconds, and kept so if that brings a held-out view closer."""

from dataclasses import replace

from jaxtyping import Float
from torch import Tensor

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.splat.refine import Budget, refine
from langflash_core.surface.fused import fused
from langflash_core.types import Scene


def refined(
    scene: Scene, images: Float[Tensor, "V 3 H W"], seconds: float, device: str, progress: Progress
) -> Scene:
    """One surface of the scene fitted to its photos, or the scene as it was with a warning that says why; on
    the CPU again."""
    try:
        result = refine(_moved(fused(scene), device), images.to(device), Budget(seconds), progress)
    except InputError as reason:
        return scene.with_record(warnings=(*scene.record.warnings, f"not refined: {reason}"))
    fitted = result.recorded().scene
    if result.kept:
        return _moved(fitted, "cpu")
    record = fitted.record.refinement
    before, after = record["held_out_psnr_db"]
    note = f"not refined: {record['held_out']}, held out, came no closer ({before} dB, then {after} dB)"
    return scene.with_record(refinement=record, warnings=(*scene.record.warnings, note))


def _moved(scene: Scene, device: str) -> Scene:
    """Gaussians and cameras on a device."""
    return replace(
        scene,
        gaussians=scene.gaussians.map(lambda values: values.to(device)),
        viewmats=scene.viewmats.to(device),
        Ks=scene.Ks.to(device),
    )
