"""What one click selects in a room of which every thing is known.

Things are clicked at three points of the photo that shows most of them: where they
are widest, and at two chosen by their number, each with what a small disc around it shows, as in the window.
What is selected is compared with the thing by the pixels that Gaussians fill in their own photos:
intersection over union.

Sizes: N Gaussians, I true instances, H W pixels of a photo.
"""

import math
from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float, Integer
from scipy.ndimage import distance_transform_edt

from langflash_core.geometry.surfels import covered_areas
from langflash_core.lab.training.measures import nan_mean
from langflash_core.scene.regions import Regions, regions_of
from langflash_core.splat.picking import seen_in
from langflash_core.types import Scene

POINTS = 3
RIGHT = 0.5
_RADIUS = 4.0  # pixels of a photo, around a click
_INSIDE = 3.0  # pixels of a photo, from a thing's border, where it is so wide


def judge_clicks(
    scene: Scene,
    instances: Integer[np.ndarray, "V H W"],
    things: list[int],
    true: Integer[np.ndarray, " N"],
) -> dict[str, float]:
    """Mean overlap, share of clicks above `RIGHT`, and both of the best of all levels that a click offers.

    Args:
        instances: of the photos. things: those that are clicked. true: the instance that each Gaussian is of.
    """
    regions, masses = regions_of(scene), own_pixels(scene)
    told = [
        (overlap, best)
        for thing in things
        for view, pixels in clicks(instances, thing)
        for overlap, best in [_overlaps(scene, regions, view, pixels, masses, true == thing)]
    ]
    return {
        "click_iou": nan_mean(overlap for overlap, _ in told),
        "click_right": nan_mean(float(overlap > RIGHT) for overlap, _ in told),
        "click_best_iou": nan_mean(best for _, best in told),
        "click_best_right": nan_mean(float(best > RIGHT) for _, best in told),
    }


def clicks(
    instances: Integer[np.ndarray, "V H W"], thing: int
) -> Iterator[tuple[int, Bool[np.ndarray, "H W"]]]:
    """Of each click the photo, and what it looks at."""
    view = int((instances == thing).sum((1, 2)).argmax())
    deep = np.asarray(distance_transform_edt(np.pad(instances[view] == thing, 1)))[1:-1, 1:-1]
    inside = np.argwhere(deep >= min(_INSIDE, deep.max()))
    more = inside[np.random.default_rng(thing).choice(len(inside), POINTS - 1)]
    lines, columns = np.indices(deep.shape)
    for line, column in (np.unravel_index(deep.argmax(), deep.shape), *more):
        yield view, np.asarray(np.hypot(lines - line, columns - column) <= _RADIUS)


def own_pixels(scene: Scene) -> Float[np.ndarray, " N"]:
    """About how many pixels each Gaussian fills in the photo that made it, in all photos' own unit."""
    means = scene.gaussians.means.detach().cpu().double().numpy()
    views = np.zeros(len(means), int) if scene.view_ids is None else scene.view_ids.cpu().numpy()
    rows = scene.viewmats.detach().cpu().double().numpy()[views, 2]
    depths = (means * rows[:, :3]).sum(1) + rows[:, 3]
    focal = scene.Ks.detach().cpu().double().numpy()[views, 0, 0]
    return np.where(depths > 0, covered_areas(scene.gaussians) * (focal / np.maximum(depths, 1e-9)) ** 2, 0.0)


def _overlaps(
    scene: Scene,
    regions: Regions,
    view: int,
    pixels: Bool[np.ndarray, "H W"],
    masses: Float[np.ndarray, " N"],
    true: Bool[np.ndarray, " N"],
) -> tuple[float, float]:
    """Of what a click selects, and the best of its levels; 0 where it selects nothing."""
    height, width = pixels.shape
    seen = seen_in(scene, np.ones(len(true), bool), scene.camera(view, width, height), pixels)
    reach = regions.around(seen)
    if reach is None:
        return 0.0, 0.0
    found = [overlap(reach.rows(level), true, masses) for level in range(reach.count)]
    return found[reach.chosen], max(found)


def overlap(
    first: Bool[np.ndarray, " N"], second: Bool[np.ndarray, " N"], masses: Float[np.ndarray, " N"]
) -> float:
    """Intersection over union; NaN of nothing."""
    both = float(masses[first | second].sum())
    return float(masses[first & second].sum()) / both if both else math.nan
