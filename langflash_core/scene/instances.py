"""Connected things among Gaussians: which belong together because they touch, in 3D and so in every view."""

import numpy as np
from jaxtyping import Bool, Float, Integer
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from langflash_core.types import Gaussians

LINK = 4.0
"""Mean radii within which two Gaussians touch. On scenes of photos the parts are the same from 3 to 8; below,
surfaces fall apart, since neighbours of a pixel's size are 1.5 radii apart."""
SMALLEST = 0.02  # of the largest thing's surface: less is a crumb
_NEIGHBOURS = 16  # asked of each: more than a surface needs to stay in one piece


def instances(
    gaussians: Gaussians, members: Bool[np.ndarray, " N"], link: float = LINK
) -> Integer[np.ndarray, " N"]:
    """Numbers of connected things among some Gaussians.

    i and j touch where one is among the nearest of the other and |mu_i - mu_j| <= link (r_i + r_j) / 2,
    r the radius of the disc that a Gaussian covers: the mean of its two largest scales. So the distance
    follows the scene's unit, and grows where things are far from the photos and Gaussians large. Streaks
    between a thing and what is behind it are too thin to connect them.

    Args:
        members: what takes part.

    Returns:
        From 1, the largest surface (sum of r^2) first; 0 for others, and for crumbs below `SMALLEST` of it.
    """
    parts, radii = connected(gaussians, members, link)
    some = parts >= 0
    if not some.any():
        return np.zeros(len(members), np.int64)
    surfaces = np.bincount(parts[some], radii[some] ** 2)
    order = np.argsort(-surfaces, kind="stable")
    kept = order[surfaces[order] >= SMALLEST * surfaces.max()]
    names = np.zeros(len(surfaces) + 1, np.int64)  # the last for those that take no part
    names[kept] = np.arange(1, len(kept) + 1)
    return names[parts]


def connected(
    gaussians: Gaussians, members: Bool[np.ndarray, " N"], link: float = LINK
) -> tuple[Integer[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """A number from 0 for the connected part of each, -1 of what is no member or not finite; and their
    radii."""
    parts, radii = np.full(len(members), -1, np.int64), disc_radii(gaussians)
    means = gaussians.means.detach().cpu().double().numpy()
    rows = np.flatnonzero(members & np.isfinite(means).all(1))
    if len(rows):
        parts[rows] = _touching(means[rows], radii[rows], link)
    return parts, radii


def disc_radii(gaussians: Gaussians) -> Float[np.ndarray, " N"]:
    """Radius of the disc that each Gaussian covers, scene units: the mean of its two largest scales."""
    scales = np.sort(gaussians.scales.detach().cpu().double().numpy(), axis=1)
    return np.nan_to_num(scales[:, 1:].mean(1), nan=0.0, posinf=0.0, neginf=0.0)


def touching(
    gaussians: Gaussians, link: float = LINK
) -> tuple[Integer[np.ndarray, " m"], Integer[np.ndarray, " m"]]:
    """Rows of the pairs of Gaussians that touch, as `instances` says; what is not finite touches nothing."""
    means = gaussians.means.detach().cpu().double().numpy()
    rows = np.flatnonzero(np.isfinite(means).all(1))
    starts, others = _pairs(means[rows], disc_radii(gaussians)[rows], link)
    return rows[starts], rows[others]


def _touching(
    means: Float[np.ndarray, "n 3"], radii: Float[np.ndarray, " n"], link: float
) -> Integer[np.ndarray, " n"]:
    """A number from 0 for the connected part of each."""
    starts, others = _pairs(means, radii, link)
    graph = coo_matrix((np.ones(len(starts), bool), (starts, others)), shape=(len(means), len(means)))
    return connected_components(graph, directed=False)[1]


def _pairs(
    means: Float[np.ndarray, "n 3"], radii: Float[np.ndarray, " n"], link: float
) -> tuple[Integer[np.ndarray, " m"], Integer[np.ndarray, " m"]]:
    """Rows of the pairs that touch; each is a pair with itself, too."""
    count = len(means)
    if not count:
        return np.zeros(0, int), np.zeros(0, int)
    distances, others = KDTree(means).query(means, k=min(_NEIGHBOURS + 1, count))
    distances, others = np.reshape(distances, (count, -1)), np.reshape(others, (count, -1))
    near = distances <= link * (radii[:, None] + radii[others]) / 2
    return np.repeat(np.arange(count), near.sum(1)), others[near]
