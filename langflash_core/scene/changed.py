"""Gaussians moved and recoloured as `langflash_core.scene.changes` says."""

from collections.abc import Iterable
from dataclasses import replace

import torch
from jaxtyping import Int, Shaped
from torch import Tensor

from langflash_core.geometry.harmonics import SH_C0, sh_to_colour
from langflash_core.geometry.quaternions import multiply_quats
from langflash_core.geometry.turning import turned_sh
from langflash_core.scene.changes import Change, Moved, Recoloured, turn_matrix
from langflash_core.scene.edits import Marks
from langflash_core.types import LUMA, Gaussians, Scene


def apply_changes(
    gaussians: Gaussians, changes: Iterable[Change], rows: Int[Tensor, " n"] | None = None
) -> Gaussians:
    """The Gaussians after all changes, in order; fields that none of them touches are the same tensors.

    Numbers are computed in float64 and kept in the fields' own type. Coefficients of degree 1 to 3 turn
    with what is turned; those of degree 4, which nobody shows, are 0 there afterwards.

    Args:
        gaussians: n of them. rows: (n,) int64, which of the masks' rows each is; None: its own.
    """
    for change in changes:
        chosen = torch.from_numpy(change.rows.rows())
        chosen = (chosen if rows is None else chosen[rows]).to(gaussians.means.device)
        if not bool(chosen.any()):
            continue
        if isinstance(change, Moved):
            gaussians = _apply_motion(gaussians, chosen, change)
        else:
            gaussians = _apply_colour(gaussians, chosen, change)
    return gaussians


def changed_scene(scene: Scene, marks: Marks, more: Change | None = None) -> Scene:
    """The scene with its Gaussians as the marks changed them, every one still in its row.

    more: a change that is not in the marks yet.
    """
    gaussians = apply_changes(scene.gaussians, (*marks.changes, *(() if more is None else (more,))))
    return scene if gaussians is scene.gaussians else replace(scene, gaussians=gaussians)


def mean_luma(gaussians: Gaussians, rows: Shaped[Tensor, " n"]) -> float:
    """Mean brightness of Gaussians (n,) bool, by their opacity, seen along +z; 0 of none."""
    some = gaussians.rows(rows)
    ahead = torch.tensor([0.0, 0.0, 1.0]).expand(len(some), 3)
    luma = sh_to_colour(some.sh.double(), ahead.double()) @ torch.tensor(LUMA, dtype=torch.float64)
    weights = some.opacities.double()
    total = float(weights.sum())
    return float((luma * weights).sum()) / total if total > 0 else 0.0


def _apply_motion(gaussians: Gaussians, chosen: Tensor, change: Moved) -> Gaussians:
    """mu' = s R mu + t, R' = R_t R, s' = s s, c'(d) = c(R^T d)."""
    matrix = torch.from_numpy(turn_matrix(change.turn)).to(gaussians.means.device)
    means = change.scale * gaussians.means[chosen].double() @ matrix.T
    means = means + torch.tensor(change.offset, dtype=torch.float64, device=means.device)
    fields = {"means": _with(gaussians.means, chosen, means)}
    if change.scale != 1.0:
        fields["scales"] = _with(gaussians.scales, chosen, change.scale * gaussians.scales[chosen].double())
    if change.turn != (1.0, 0.0, 0.0, 0.0):
        turn = torch.tensor(change.turn, dtype=torch.float64, device=means.device)
        quats = gaussians.quats[chosen].double()
        fields["quats"] = _with(gaussians.quats, chosen, multiply_quats(turn.expand_as(quats), quats))
        if gaussians.sh.shape[1] > 1:
            turned = turned_sh(gaussians.sh[chosen].double(), matrix.cpu())
            harmonics = turned.new_zeros(len(turned), *gaussians.sh.shape[1:])
            harmonics[:, : turned.shape[1]] = turned
            fields["sh"] = _with(gaussians.sh, chosen, harmonics)
    return replace(gaussians, **fields)


def _apply_colour(gaussians: Gaussians, chosen: Tensor, change: Recoloured) -> Gaussians:
    """0.5 + sum_b Y_b c_b is linear in the coefficients: c_b' = M c_b, and Y_0 c_0' takes up M 0.5 - 0.5."""
    matrix = torch.tensor(change.matrix, dtype=torch.float64, device=gaussians.sh.device).view(3, 3)
    harmonics = gaussians.sh[chosen].double() @ matrix.T
    harmonics[:, 0] += (0.5 * matrix.sum(1) - 0.5) / SH_C0
    return replace(gaussians, sh=_with(gaussians.sh, chosen, harmonics))


def _with(values: Tensor, chosen: Tensor, some: Tensor) -> Tensor:
    """A copy with other values in the chosen rows."""
    copy = values.clone()
    copy[chosen] = some.to(values)
    return copy
