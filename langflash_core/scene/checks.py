"""What makes a `Scene` whole beyond what its constructor holds: finite values, ranges that hold."""

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
    if scene.gaussians.sh.shape[1] not in SH_BASES:
        found = tuple(scene.gaussians.sh.shape)
        raise ValueError(f"sh: expected (N, S, 3) with S in {SH_BASES}, received {found}")
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
    atom_norms = semantics.dictionary.norm(dim=-1)
    _holds("dictionary", "rows of unit norm", bool(((atom_norms - 1).abs() < _SLACK).all()))


def _check_views(scene: Scene) -> None:
    focal = torch.stack((scene.Ks[:, 0, 0], scene.Ks[:, 1, 1]))
    _holds("Ks", "focal lengths above 0", bool((focal > 0).all()))
    rotations = scene.viewmats[:, :3, :3].double()
    identity = torch.eye(3, dtype=torch.float64, device=rotations.device)
    rigid = (rotations @ rotations.transpose(-1, -2) - identity).abs().amax() < _SLACK
    _holds("viewmats", "rotations and translations", bool(rigid) and bool((rotations.det() > 0).all()))


def _holds(name: str, expected: str, holds: bool) -> None:
    if not holds:
        raise ValueError(f"{name}: expected {expected}, received others")


def _bad_count(values: Tensor) -> int:
    return int((~torch.isfinite(values)).sum())
