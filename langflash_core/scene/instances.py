"""Connected things among Gaussians: which belong together because they touch, in 3D and so in every view; in
a scene of layers, too, because a photo shows both at one place."""

import numpy as np
import torch
from jaxtyping import Bool, Float, Integer
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from langflash_core.rig.projected import project_points
from langflash_core.scene.settings import INSTANCES
from langflash_core.types import Gaussians, Scene


def instances(
    gaussians: Gaussians, members: Bool[np.ndarray, " N"], link: float = INSTANCES.link
) -> Integer[np.ndarray, " N"]:
    """Numbers of connected things among some Gaussians.

    i and j touch where one is among the nearest of the other and |mu_i - mu_j| <= link (r_i + r_j) / 2,
    r the radius of the disc that a Gaussian covers: the mean of its two largest scales. So the distance
    follows the scene's unit, and grows where things are far from the photos and Gaussians large. Streaks
    between a thing and what is behind it are too thin to connect them.

    Args:
        members: what takes part.

    Returns:
        From 1, the largest surface (sum of r^2) first; 0 for others, and for crumbs below
        `INSTANCES.smallest` of it.
    """
    return _number_parts(*connected_parts(gaussians, members, link))


def things(scene: Scene, members: Bool[np.ndarray, " N"]) -> Integer[np.ndarray, " N"]:
    """`instances` of a scene; of a scene of layers, a thing that several of them show is one, although their
    depths may lie farther apart than what touches.

    Parts a and b are one where the photo of b's layer shows, at the pixels of b and within `INSTANCES.same`
    of their depth, at least `INSTANCES.shown` of the smaller one's surface of a.
    """
    return _number_parts(*parts_of(scene, members))


def parts_of(
    scene: Scene, members: Bool[np.ndarray, " N"]
) -> tuple[Integer[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """`connected_parts` of a scene; what several layers show has one number, as in `things`."""
    parts, radii = connected_parts(scene.gaussians, members)
    if scene.layered and parts.max(initial=-1) > 0:
        parts = _as_one(scene, parts, radii)
    return parts, radii


def _number_parts(
    parts: Integer[np.ndarray, " N"], radii: Float[np.ndarray, " N"]
) -> Integer[np.ndarray, " N"]:
    """Numbers of `instances`, of parts from 0, -1 of none."""
    some = parts >= 0
    if not some.any():
        return np.zeros(len(parts), np.int64)
    surfaces = np.bincount(parts[some], radii[some] ** 2)
    order = np.argsort(-surfaces, kind="stable")
    kept = order[surfaces[order] >= INSTANCES.smallest * surfaces.max()]
    names = np.zeros(len(surfaces) + 1, np.int64)  # the last for those that take no part
    names[kept] = np.arange(1, len(kept) + 1)
    return names[parts]


def _as_one(
    scene: Scene, parts: Integer[np.ndarray, " N"], radii: Float[np.ndarray, " N"]
) -> Integer[np.ndarray, " N"]:
    """Parts, those that are one thing in several layers with one number."""
    assert scene.view_ids is not None
    rows = np.flatnonzero(parts >= 0)
    own, areas, views = parts[rows], radii[rows] ** 2, scene.view_ids.cpu().numpy()[rows]
    means = scene.gaussians.means.detach().cpu()[torch.from_numpy(rows)].double().T
    count = int(own.max()) + 1
    surfaces, graph = np.bincount(own, areas, count), coo_matrix((count, count), dtype=bool)
    for view in np.unique(views[views >= 0]).tolist():
        there = _shown_at(scene, view, means, own, views == view)
        met = (there >= 0) & (there != own)
        pairs, which = np.unique(own[met] * np.int64(count) + there[met], return_inverse=True)
        ends = np.divmod(pairs, count)
        least = INSTANCES.shown * np.minimum(surfaces[ends[0]], surfaces[ends[1]])
        enough = np.bincount(which, areas[met], len(pairs)) >= least
        graph += coo_matrix((enough, ends), (count, count))
    return np.append(connected_components(graph, directed=False)[1], -1)[parts]


def _shown_at(
    scene: Scene,
    view: int,
    means: Float[torch.Tensor, "3 n"],
    parts: Integer[np.ndarray, " n"],
    of_view: Bool[np.ndarray, " n"],
) -> Integer[np.ndarray, " n"]:
    """The part of which a photo's layer shows something where each of some Gaussians is: at its pixel, and at
    its depth to within `INSTANCES.same`; -1 where it does not."""
    viewmat, K = (values.detach().cpu().double() for values in (scene.viewmats[view], scene.Ks[view]))
    width, height = scene.view_size
    there = project_points(means, viewmat, K, (height, width))
    inside, pixels = there.inside.numpy(), there.pixels.numpy()
    logs = np.log(np.where(inside, there.z.numpy(), 1.0))
    shown, deep = np.full(width * height, -1), np.zeros(width * height)
    own = np.flatnonzero(inside & of_view)
    own = own[np.argsort(-logs[own], kind="stable")]  # of several in a pixel the nearest stays
    shown[pixels[own]], deep[pixels[own]] = parts[own], logs[own]
    return np.where(inside & (np.abs(logs - deep[pixels]) <= INSTANCES.same), shown[pixels], -1)


def connected_parts(
    gaussians: Gaussians, members: Bool[np.ndarray, " N"], link: float = INSTANCES.link
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
    gaussians: Gaussians, link: float = INSTANCES.link
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
    distances, others = KDTree(means).query(means, k=min(INSTANCES.neighbours + 1, count))
    distances, others = np.reshape(distances, (count, -1)), np.reshape(others, (count, -1))
    near = distances <= link * (radii[:, None] + radii[others]) / 2
    return np.repeat(np.arange(count), near.sum(1)), others[near]
