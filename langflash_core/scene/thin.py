"""Fewer Gaussians for a moving camera on a slow machine: wider ones, or coarse ones and some detail."""

import math
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float, Int

from langflash_core.geometry.surfels import covered_areas, finite_rows
from langflash_core.types import Gaussians, Scene

_THIRD = 1 / 3
_CELLS = 1 << 10  # a side of the grid that orders Gaussians along a space-filling curve


def thin(scene: Scene, share: float) -> Scene:
    """About `share` of the Gaussians, widened so that as much is covered as before.

    Gaussian i is kept with probability p_i = min(1, c a_i), a_i its opacity times the area of its two
    longest axes, and its axes grow by p_i^-1/2: what it covers, times p_i, stays a_i. Large ones are
    therefore kept as they are and small ones give way to dots of one size. One draw serves all: along
    a space-filling curve every 1 / p-th is taken, so that neighbours stand in for each other.

    Of a scene that knows its levels all coarse ones stay, and nothing is widened: they are closed, and some
    of the detail lies on them, of which p_i = min(1, c a_i d_i), d_i the mean difference of its colour and
    the nearest coarse one's: what changes the picture most. A share of `coarse_share` is the coarse ones
    alone, a smaller one these thinned as a scene of their own.

    Of a scene of layers each is thinned for itself, so that it stays closed: the curve goes through one layer
    after the other, and detail is compared with the coarse ones of its own.

    Args:
        share: in (0, 1].

    Returns:
        The scene with at most ceil(share N) Gaussians, or itself for a share of 1. Gaussians
        that are not finite or show nothing are never kept.

    Raises:
        ValueError: a share outside (0, 1].

    Source: systematic sampling with probabilities proportional to size (Madow 1949); Z-order of Morton 1966.
    """
    return thin_with_rows(scene, share)[0]


def thin_with_rows(scene: Scene, share: float) -> tuple[Scene, Int[np.ndarray, " n"]]:
    """`thin`, and the rows of the scene that were kept, ascending."""
    if not 0 < share <= 1:
        raise ValueError(f"share: expected a number in (0, 1], received {share}")
    if share == 1 or not len(scene.gaussians):
        return scene, np.arange(len(scene.gaussians))
    coarse = coarse_share(scene)
    if coarse < 1:
        return _thin_levels(scene, share, coarse)
    return _drawn(scene, covered_areas(scene.gaussians), _curve(scene), share)


class Thinner:
    """`thin` of a huge scene without levels from one place after the other: the same number of Gaussians, all
    of those near the eye and the fewer the farther they are.

    As `thin`, with p_i = min(1, c a_i / r_i^2), r_i the distance from the eye: what a Gaussian covers of the
    eye's picture decides instead of what it covers of the scene. What does not depend on the eye is computed
    once.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._areas = covered_areas(scene.gaussians)
        self._along = _curve(scene)

    def around(self, eye: Float[np.ndarray, "3"], share: float) -> tuple[Scene, Int[np.ndarray, " n"], float]:
        """The scene with at most ceil(share N) Gaussians, their rows, ascending, and how far from the eye the
        middle one of them is, scene units."""
        apart = self._scene.gaussians.means.detach().cpu().numpy() - np.asarray(eye, np.float32)
        far = np.einsum("nc,nc->n", apart, apart).astype(np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            seen = np.where(self._areas > 0, self._areas / np.maximum(far, 1e-12), 0.0)
        thinned, rows = _drawn(self._scene, seen, self._along, share)
        return thinned, rows, math.sqrt(float(np.median(far[rows]))) if len(rows) else math.inf


def _drawn(
    scene: Scene, sizes: np.ndarray, along: np.ndarray, share: float
) -> tuple[Scene, Int[np.ndarray, " n"]]:
    """About `share` of the Gaussians, by sizes (N,), wider in return."""
    chances = inclusion(sizes, share * len(sizes))
    rows = np.sort(_draw_rows(chances, along))
    growth = torch.from_numpy(chances[rows] ** -0.5).to(scene.gaussians.scales)
    thinned = scene.rows(torch.from_numpy(rows))
    wider = replace(thinned.gaussians, scales=thinned.gaussians.scales * growth[:, None])
    return replace(thinned, gaussians=wider), rows


def coarse_level(scene: Scene) -> Scene:
    """The scene at its least detail: the coarse Gaussians alone, which are closed; of a scene that does not
    know its levels, or has one alone, a third, wider. One of less than three Gaussians stays as it is."""
    share = coarse_share(scene)
    if share < 1:
        assert scene.levels is not None
        return scene.rows(torch.nonzero(scene.levels.cpu() == 0)[:, 0])
    return thin(scene, _THIRD) if len(scene.gaussians) * _THIRD >= 1 else scene


def _thin_levels(scene: Scene, share: float, coarse: float) -> tuple[Scene, np.ndarray]:
    """`thin_with_rows` of a scene with levels."""
    assert scene.levels is not None
    levels = scene.levels.cpu().numpy()
    closed, detail = np.flatnonzero(levels == 0), np.flatnonzero(levels)
    if share <= coarse:
        thinned, some = thin_with_rows(scene.rows(torch.from_numpy(closed)), share / coarse)
        return thinned, closed[some]
    fine = scene.rows(torch.from_numpy(detail))
    tells = np.zeros(len(detail))
    for part in _layers(scene):
        own = part[detail]
        tells[own] = _detail_worth(
            scene.gaussians.rows(torch.from_numpy(closed[part[closed]])),
            fine.gaussians.rows(torch.from_numpy(own)),
        )
    chances = inclusion(tells, share * len(levels) - len(closed))
    chosen = detail[_draw_rows(chances, _curve(fine))]
    rows = np.sort(np.concatenate((closed, chosen)))
    return scene.rows(torch.from_numpy(rows)), rows


def _detail_worth(coarse: Gaussians, detail: Gaussians) -> np.ndarray:
    """How much each of the detail (n,) changes what the nearest coarse one shows: its area times the mean
    difference of their colours."""
    from scipy.spatial import KDTree

    areas = covered_areas(detail)
    there, own = (finite_rows(each.means).numpy() for each in (coarse, detail))
    tells = np.zeros(len(areas))
    if there.any() and own.any():
        near = KDTree(coarse.means.cpu().numpy()[there]).query(detail.means.cpu().numpy()[own])[1]
        colours = detail.sh[:, 0].cpu().numpy()[own] - coarse.sh[:, 0].cpu().numpy()[there][near]
        tells[own] = areas[own] * np.nan_to_num(abs(colours).mean(1), posinf=0.0)
    return tells


def _layers(scene: Scene) -> list[np.ndarray]:
    """(N,) bool of each layer; of a scene that has none, all."""
    if not scene.layered or scene.view_ids is None:
        return [np.ones(len(scene.gaussians), bool)]
    views = scene.view_ids.cpu().numpy()
    return [views == view for view in np.unique(views)]


def _curve(scene: Scene) -> Int[np.ndarray, " N"]:
    """Rows along a space-filling curve, of a scene of layers through one after the other."""
    along = z_order(scene.gaussians.means.detach().cpu().numpy())
    if scene.layered and scene.view_ids is not None:
        along = along[np.argsort(scene.view_ids.cpu().numpy()[along], kind="stable")]
    return along


def _draw_rows(chances: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Rows that one draw along a curve keeps, each with its chance (N,)."""
    ends = np.floor(np.cumsum(chances[along]) + 1e-9)
    return along[np.diff(ends, prepend=0.0) > 0]


def coarse_share(scene: Scene) -> float:
    """Share of the Gaussians that are coarse, in (0, 1]; 1 where nobody knows, or all are one level."""
    count = 0 if scene.levels is None else int((scene.levels == 0).sum())
    return count / len(scene.gaussians) if count else 1.0


def inclusion(sizes: Float[np.ndarray, " N"], expected: float) -> Float[np.ndarray, " N"]:
    """Probabilities (N,) min(1, c s_i) with the c >= 0 that makes their sum `expected`.

    With fewer positive sizes than that, every one of those is 1.
    """
    descending = np.sort(sizes)[::-1]
    if np.count_nonzero(descending) <= expected:
        return (sizes > 0).astype(np.float64)
    rest = np.cumsum(descending[::-1])[::-1]  # sum of the sizes from each on
    # With the j largest at 1, c = (expected - j) / rest_j; the right j is the first where c s_j <= 1.
    ahead = np.arange(len(descending))
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(rest > 0, (expected - ahead) / rest, 0.0)
    certain = int(np.argmax(scale * descending <= 1))
    return np.minimum(1.0, scale[certain] * sizes)


def z_order(means: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """Rows of means (N, 3) along the Z-curve of a grid of 1024 cells a side; far outliers share the rim."""
    finite = np.where(np.isfinite(means), means, 0.0).astype(np.float64)
    low, high = np.percentile(finite, (1, 99), axis=0)
    cells = np.clip((finite - low) / np.maximum(high - low, 1e-12) * _CELLS, 0, _CELLS - 1).astype(np.uint32)
    code = (
        _spread_bits(cells[:, 0])
        | _spread_bits(cells[:, 1]) << np.uint32(1)
        | _spread_bits(cells[:, 2]) << np.uint32(2)
    )
    return np.argsort(code, kind="stable")


def _spread_bits(bits: np.ndarray) -> np.ndarray:
    """Ten bits to every third place of thirty."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        bits = (bits | bits << np.uint32(shift)) & np.uint32(mask)
    return bits
