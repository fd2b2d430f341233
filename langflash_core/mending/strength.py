"""How strongly a scene must be cleaned until each Gaussian goes: one number each, whatever the kind of
rubbish.

    floaters   stand alone, faint, or among the faint (`scene.selection.isolation`)
    crumbs     clumps that touch nothing else and have little surface
    sheets     stretched along the photos' rays: smeared between a thing and what is behind it
    flyaways   lie much farther from the middle than others

A kind's score s is compared with a limit that falls with the strength t in (0, 1],

    l(t) = l_0 (l_1 / l_0)^t,    so that i goes from  t_i = log(l_0 / s_i) / log(l_0 / l_1)  on,

0 where the score is above l_0, infinite below l_1. What several kinds find goes from the least of theirs on.
So a preview at another strength compares N numbers, and strengths mean the same in all scenes.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.geometry.surfels import covered_areas
from langflash_core.mending.settings import CRUMBS
from langflash_core.scene.instances import connected_parts
from langflash_core.scene.selection import isolation
from langflash_core.scene.settings import INSTANCES
from langflash_core.types import Scene

from .recipes import KINDS

LIMITS = {"floaters": (14.0, 2.5), "crumbs": (6.0, 3.0), "sheets": (80.0, 15.0), "flyaways": (12.0, 4.0)}
"""l_0 and l_1 of each kind, chosen on rendered rooms (MEASURED.md, "Floaters that were planted")."""
NEVER = np.inf


def least_strengths(
    scene: Scene, visible: Bool[np.ndarray, " N"], kinds: Sequence[str] = KINDS
) -> Float[np.ndarray, " N"]:
    """The strength from which each Gaussian goes, float32 in [0, 1]; infinite for those that stay at any.

    Args:
        visible: what takes part.

    Raises:
        InputError: a kind that there is not.
    """
    never = np.full(len(visible), NEVER, np.float32)
    return np.minimum.reduce([never, *kind_strengths(scene, visible, kinds).values()])


def kind_strengths(
    scene: Scene, visible: Bool[np.ndarray, " N"], kinds: Sequence[str] = KINDS
) -> dict[str, Float[np.ndarray, " N"]]:
    """As `least_strengths`, kind by kind; what one kind finds at any strength takes no part in the next
    one's. Each layer of a scene that has some is looked at by itself, as a photo's own scene."""
    unknown = [kind for kind in kinds if kind not in KINDS]
    if unknown:
        raise InputError(f"there is no kind '{unknown[0]}' to clean up; choose {', '.join(KINDS)}")
    views = torch.zeros(0) if scene.view_ids is None else scene.view_ids.unique()
    if scene.layered and bool((views >= 0).any()):
        return _of_layers(scene, visible, kinds, [int(view) for view in views if view >= 0])
    found, left = {}, visible.copy()
    for kind in (kind for kind in KINDS if kind in kinds and visible.sum() >= CRUMBS.fewest):
        least = _least(_SCORES[kind](scene, left), *LIMITS[kind])
        found[kind] = np.where(left, least, NEVER).astype(np.float32)
        left &= found[kind] == NEVER  # sheets would connect crumbs with what they are no part of
    return found


def _of_layers(
    scene: Scene, visible: Bool[np.ndarray, " N"], kinds: Sequence[str], views: Sequence[int]
) -> dict[str, Float[np.ndarray, " N"]]:
    """`kind_strengths` of a scene of layers. What no photo made goes where it is rubbish in all of them."""
    assert scene.view_ids is not None
    ids = scene.view_ids.cpu().numpy()
    found = {kind: np.where(ids < 0, 0.0, NEVER).astype(np.float32) for kind in KINDS if kind in kinds}
    for view in views:
        rows = np.flatnonzero((ids == view) | (ids < 0))
        told = kind_strengths(scene.layer(view), visible[rows], kinds)
        for kind, least in found.items():
            own = told.get(kind, np.full(len(rows), NEVER, np.float32))
            least[rows] = np.where(ids[rows] < 0, np.maximum(least[rows], own), own)
    return found


def choose_removed(least: Float[np.ndarray, " N"], strength: float) -> Bool[np.ndarray, " N"]:
    """What goes at a strength in [0, 1]; nothing at 0."""
    return (least <= strength) & (strength > 0)


def _least(scores: Float[np.ndarray, " N"], first: float, last: float) -> Float[np.ndarray, " N"]:
    with np.errstate(divide="ignore"):
        least = np.log(first / np.maximum(scores, 1e-30)) / np.log(first / last)
    return np.where(scores >= last, np.clip(least, 0, 1), NEVER)


def _floaters(scene: Scene, visible: Bool[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    return isolation(scene.gaussians, visible).astype(np.float64)


def _crumbs(scene: Scene, visible: Bool[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """-log10 of the share of all surface that the connected part of each has, where nothing else is near."""
    scores = np.zeros(len(visible))
    parts, radii = connected_parts(scene.gaussians, visible)
    surfaces = np.bincount(parts[parts >= 0], (radii**2)[parts >= 0])
    small = (parts >= 0) & (surfaces[parts] < 10 ** -LIMITS["crumbs"][1] * surfaces.sum())
    rest = (parts >= 0) & ~small
    if not small.any() or not rest.any():
        return scores
    means = scene.gaussians.means.detach().cpu().double().numpy()
    distance, which = KDTree(means[rest]).query(means[small])
    reach = CRUMBS.apart * INSTANCES.link * (radii[small] + radii[rest][which]) / 2
    nearest = np.full(len(surfaces), np.inf)
    np.minimum.at(nearest, parts[small], distance / reach)  # the nearest of a part speaks for all of it
    shares = surfaces[parts[small]] / surfaces.sum()
    scores[small] = np.where(nearest[parts[small]] > 1, -np.log10(np.maximum(shares, 1e-12)), 0.0)
    return scores


def _sheets(scene: Scene, visible: Bool[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """How many times as far each reaches along the ray of its photo as across it; of the nearest where nobody
    knows its photo. Of a scene without photos nothing."""
    if scene.view_ids is None and not scene.photos:
        return np.zeros(len(visible))
    gaussians = scene.gaussians.map(lambda values: values.detach().cpu().double())
    eyes = invert_rigid(scene.viewmats.cpu().double())[:, :3, 3]
    near = torch.cdist(gaussians.means, eyes).argmin(1)
    views = near if scene.view_ids is None else torch.where(scene.view_ids < 0, near, scene.view_ids)
    rays = torch.nn.functional.normalize(gaussians.means - eyes[views], dim=-1)
    axes = quats_to_matrices(gaussians.quats) * gaussians.scales[:, None]  # columns: axes times deviations
    along = (axes * rays[..., None]).sum(1).norm(dim=-1)
    volume = gaussians.scales.prod(-1)  # of the shadow: the product of both deviations across the ray
    flat = torch.einsum("nij,nj->ni", quats_to_matrices(gaussians.quats).mT, rays)
    inverse = (flat / gaussians.scales.clamp_min(1e-12)).norm(dim=-1)
    across = (volume * inverse).clamp_min(1e-24).sqrt()
    return np.where(visible, np.nan_to_num((along / across).numpy(), posinf=0.0), 0.0)


def _flyaways(scene: Scene, visible: Bool[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Robust deviations of the logarithm of the distance from the middle of what is there."""
    means = scene.gaussians.means.detach().cpu().double().numpy()
    areas = covered_areas(scene.gaussians) * visible
    shown = areas > 0
    if not shown.any():
        return np.zeros(len(visible))
    middle = np.median(means[shown], axis=0)
    far = np.log(np.maximum(np.linalg.norm(means - middle, axis=1), 1e-12))
    usual = np.median(far[shown])
    above = far[shown & (far > usual)] - usual
    deviation = max(1.4826 * float(np.median(above)) if len(above) else 0.0, 0.1)
    return np.where(shown, (far - usual) / deviation, 0.0)


_SCORES = {"floaters": _floaters, "crumbs": _crumbs, "sheets": _sheets, "flyaways": _flyaways}
