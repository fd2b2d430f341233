"""What makes a `Scene` whole: shapes that agree, finite values, ranges that hold."""

import torch
from torch import Tensor

from langflash_core.types import Scene

SH_BASES = (1, 4, 9, 16, 25)
_SLACK = 1e-2  # float16 rounding of up to 25 weights in a row, or of a quaternion's norm


def check_scene(scene: Scene) -> None:
    """Refuse a scene that cannot be drawn or queried.

    Raises:
        ValueError: names the field, what was expected, and what was received.
    """
    gaussians, semantics = scene.gaussians, scene.semantics
    num_gaussians, num_views = gaussians.means.shape[0], scene.viewmats.shape[0]
    _shape("means", gaussians.means, (num_gaussians, 3))
    _shape("quats", gaussians.quats, (num_gaussians, 4))
    _shape("scales", gaussians.scales, (num_gaussians, 3))
    _shape("opacities", gaussians.opacities, (num_gaussians,))
    if gaussians.sh.ndim != 3 or gaussians.sh.shape[1] not in SH_BASES:
        raise ValueError(f"sh: expected (N, S, 3) with S in {SH_BASES}, received {tuple(gaussians.sh.shape)}")
    _shape("sh", gaussians.sh, (num_gaussians, gaussians.sh.shape[1], 3))
    _shape("weight_values", semantics.weight_values, tuple(semantics.weight_ids.shape))
    if semantics.weight_ids.ndim != 2 or semantics.dictionary.ndim != 2:
        raise ValueError("weight_ids, dictionary: expected two dimensions each")
    _shape("weight_ids", semantics.weight_ids, (num_gaussians, semantics.weight_ids.shape[1]))
    _shape("viewmats", scene.viewmats, (num_views, 4, 4))
    _shape("Ks", scene.Ks, (num_views, 3, 3))
    _check_values(scene)
    _check_views(scene)


def _check_values(scene: Scene) -> None:
    gaussians, semantics = scene.gaussians, scene.semantics
    for name, values in {
        "means": gaussians.means,
        "quats": gaussians.quats,
        "scales": gaussians.scales,
        "opacities": gaussians.opacities,
        "sh": gaussians.sh,
        "weight_values": semantics.weight_values,
        "dictionary": semantics.dictionary,
        "viewmats": scene.viewmats,
        "Ks": scene.Ks,
    }.items():
        if not bool(torch.isfinite(values).all()):
            raise ValueError(f"{name}: expected finite values, received {_bad_count(values)} that are not")
    _holds("scales", "values above 0", bool((gaussians.scales > 0).all()))
    opacities = gaussians.opacities
    _holds("opacities", "values in [0, 1]", bool(((opacities >= 0) & (opacities <= 1)).all()))
    norms = gaussians.quats.norm(dim=-1)
    _holds("quats", "unit quaternions", bool(((norms - 1).abs() < _SLACK).all()))
    sums = semantics.weight_values.sum(-1)
    whole = ((sums - 1).abs() < _SLACK) | (sums == 0)
    weights_hold = bool((semantics.weight_values >= 0).all()) and bool(whole.all())
    _holds("weight_values", "rows >= 0 that sum to 1 or 0", weights_hold)
    ids = semantics.weight_ids
    in_range = bool(((ids >= 0) & (ids < semantics.num_atoms)).all())
    _holds("weight_ids", f"values in [0, {semantics.num_atoms})", in_range)
    atom_norms = semantics.dictionary.norm(dim=-1)
    _holds("dictionary", "rows of unit norm", bool(((atom_norms - 1).abs() < _SLACK).all()))


def _check_views(scene: Scene) -> None:
    width, height = scene.view_size
    if scene.num_views < 1 or width < 1 or height < 1:
        raise ValueError(f"views: expected at least one of at least 1 pixel, received {scene.view_size}")
    if scene.photos and len(scene.photos) != scene.num_views:
        raise ValueError(f"photos: expected {scene.num_views}, one per view, received {len(scene.photos)}")
    focal = torch.stack((scene.Ks[:, 0, 0], scene.Ks[:, 1, 1]))
    _holds("Ks", "focal lengths above 0", bool((focal > 0).all()))
    rotations = scene.viewmats[:, :3, :3].double()
    identity = torch.eye(3, dtype=torch.float64, device=rotations.device)
    rigid = (rotations @ rotations.transpose(-1, -2) - identity).abs().amax() < _SLACK
    _holds("viewmats", "rotations and translations", bool(rigid) and bool((rotations.det() > 0).all()))


def _shape(name: str, values: Tensor, expected: tuple[int, ...]) -> None:
    if tuple(values.shape) != expected:
        raise ValueError(f"{name}: expected shape {expected}, received {tuple(values.shape)}")


def _holds(name: str, expected: str, holds: bool) -> None:
    if not holds:
        raise ValueError(f"{name}: expected {expected}, received others")


def _bad_count(values: Tensor) -> int:
    return int((~torch.isfinite(values)).sum())
