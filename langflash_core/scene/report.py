"""What `langflash info` says about a scene: plain JSON values."""

from torch import Tensor

from langflash_core.scene.fields import field_bytes
from langflash_core.types import Scene

_CORE = (0.01, 0.99)  # the middle 98 % along each axis: stray points do not stretch the box


def describe(scene: Scene) -> dict:
    """Counts, bytes, timings, warnings, and extent.

    Returns:
        `gaussians, atoms, channels, weights_per_gaussian (mean), sh_degree, views, view_size,
        photos, preset, source (the splat file it came from, or None), space, bytes {field: bytes,
        total}, bounding_box and core_box {min, max} in scene units (None when empty), metric_scale
        (metres per unit or None), counts, pruning (as `prune` left it, with `psnr_db` and
        `relevance_error` where they were measured), refinement (None, or kept, held_out and the PSNR
        before and after), timings {stage: seconds, total} (None where they are not known, as in files),
        warnings`.
    """
    known = scene.record
    sizes = field_bytes(scene)
    timings = known.cost.timings
    kept = scene.semantics.weight_values > 0
    return {
        "gaussians": len(scene.gaussians),
        "atoms": scene.semantics.num_atoms,
        "channels": scene.semantics.dictionary.shape[1],
        "weights_per_gaussian": float(kept.sum()) / max(1, len(scene.gaussians)),
        "sh_degree": round(scene.gaussians.sh.shape[1] ** 0.5) - 1,
        "views": scene.num_views,
        "view_size": list(scene.view_size),
        "photos": list(known.photos),
        "preset": known.preset,
        "source": known.source,
        "space": scene.semantics.space,
        "bytes": {**sizes, "total": sum(sizes.values())},
        "bounding_box": _box(scene.gaussians.means, (0.0, 1.0)),
        "core_box": _box(scene.gaussians.means, _CORE),
        "metric_scale": known.metric_scale,
        "counts": dict(known.counts),
        "pruning": dict(known.pruning) or None,
        "refinement": dict(known.refinement) or None,
        "timings": {**timings, "total": sum(timings.values())} if timings else None,
        "warnings": list(known.warnings),
    }


def _box(means: Tensor, quantiles: tuple[float, float]) -> dict | None:
    """Corners between two quantiles per axis, by rank (torch.quantile stops at 16 million)."""
    if len(means) == 0:
        return None
    ordered = means.sort(dim=0).values
    low, high = (ordered[round(q * (len(means) - 1))].tolist() for q in quantiles)
    return {"min": low, "max": high}
