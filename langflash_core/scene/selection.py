"""Selections of Gaussians by where they are: growing, floaters, the atom they belong to."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from langflash_core.scene.settings import SELECTION
from langflash_core.types import Gaussians, Semantics


def grow(
    means: Float[np.ndarray, "N 3"],
    selected: Bool[np.ndarray, " N"],
    allowed: Bool[np.ndarray, " N"],
    distance: float,
    radii: Float[np.ndarray, " N"] | None = None,
) -> Bool[np.ndarray, " N"]:
    """The selection with everything allowed that lies within `distance` of it.

    Args:
        means: (N, 3). selected, allowed: (N,) bool. distance: scene units; of Gaussians of the median of the
            allowed ones' `radii` (N,), and of wider ones as much more as they, and what is selected beside
            them, are wider: else a wall of large ones would never grow.

    Returns:
        (N,) bool, a superset of `selected`.
    """
    grown = selected.copy()
    around = np.flatnonzero(allowed & ~selected)
    if not selected.any() or not len(around):
        return grown
    nearest, which = KDTree(means[selected]).query(means[around])
    far: np.ndarray | float = distance
    if radii is not None:
        typical = max(float(np.median(radii[allowed])), 1e-12)
        far = distance * np.maximum(1, (radii[around] + radii[selected][which]) / (2 * typical))
    grown[around[nearest <= far]] = True
    return grown


def spacing(means: Float[np.ndarray, "n 3"], most: int = 4000) -> float:
    """Median distance of a Gaussian to its nearest neighbour, scene units; 0 for fewer than two.

    Measured on every n-th of them, at most about `most`, against all.
    """
    if len(means) < 2:
        return 0.0
    some = means[:: max(1, len(means) // most)]
    distances = np.asarray(KDTree(means).query(some, k=2)[0])  # (n, 2), the first its own 0
    return float(np.median(distances[:, 1]))


def isolation(gaussians: Gaussians, visible: Bool[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """How far each Gaussian stands out as a floater, in robust deviations.

    A Gaussian of a surface has opaque neighbours about as near as it is large. With d_i the mean
    distance to its 12 nearest neighbours, s_i its largest scale, o_i its opacity and q_i the mean
    opacity of those neighbours, l_i = log(d_i / s_i) - log(o_i q_i) / 2 is large for what is alone,
    faint, or among the faint. The scores are (l_i - median) / deviation, the deviation from the median
    absolute one. They do not depend on the scene's unit or order.

    Args:
        visible: (N,) bool, what takes part.

    Returns:
        (N,) float32; 0 for what is not visible, and everywhere below 2 visible Gaussians.

    Source: own, after the statistical outlier removal of Rusu et al. 2008.
    """
    scores = np.zeros(len(visible), np.float32)
    rows = np.flatnonzero(visible)
    if len(rows) < 2:
        return scores
    means = gaussians.means.detach().cpu().double().numpy()[rows]
    scales = gaussians.scales.detach().cpu().double().amax(-1).numpy()[rows]
    opacities = np.clip(gaussians.opacities.detach().cpu().double().numpy()[rows], 1e-3, 1.0)
    count = min(SELECTION.neighbours + 1, len(rows))
    distances, neighbours = KDTree(means).query(means, k=count)
    apart = np.maximum(np.asarray(distances)[:, 1:].mean(1), 1e-12)
    support = opacities[np.asarray(neighbours)[:, 1:]].mean(1)
    loneliness = np.log(apart / np.maximum(scales, 1e-12)) - 0.5 * np.log(opacities * support)
    middle = np.median(loneliness)
    deviation = max(
        SELECTION.mad_to_deviation * np.median(abs(loneliness - middle)), SELECTION.least_deviation
    )
    scores[rows] = (loneliness - middle) / deviation
    return scores


def strongest_atoms(semantics: Semantics) -> Int[np.ndarray, " N"]:
    """(N,) the atom that each Gaussian carries most of; -1 where it carries none."""
    values = semantics.weight_values.detach().cpu()
    if values.shape[1] == 0:
        return np.full(len(values), -1)
    best = values.argmax(-1, keepdim=True)
    atoms = semantics.weight_ids.cpu().gather(1, best)[:, 0]
    return np.where(values.gather(1, best)[:, 0].numpy() > 0, atoms.numpy(), -1)
