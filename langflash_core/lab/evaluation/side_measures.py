"""What holds and what breaks when one walks around a scene: pure functions of depth maps and poses.

Depths are z in metres, 0 where nothing is known or drawn; poses map the world to a camera, OpenCV axes;
H W pixels. Every measure is NaN where nothing can be measured.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation, maximum_filter, minimum_filter

from langflash_core.geometry.fusion import DepthView
from langflash_core.lab.rooms.cameras import reproject

SAME = 0.04
"""Relative difference of depth up to which two true depths are the same surface: `seen_by_photos`'s."""
EMPTY = 0.10
"""Relative difference of depth from which a drawn point is in empty space: the network's depth is often
wrong by half of it, and a surface drawn a little too near is no sheet."""
BETWEEN = 0.05
"""Relative difference of depth from either side at which a drawn point hangs between both: twice what
drawn walls ripple."""
BESIDE = 2
"""Pixels that a surface may be drawn beside its place: an edge is a mixture of both sides over one pixel,
and a twentieth of depth moves it by another at 20 degrees."""
ACROSS = 4
"""Pixels around an edge of a photo that belong to it: a depth map of 16 pixels a token smears it so far."""
REACH = 6
"""Pixels around one from which the level of its surface is taken: beyond what an edge smears."""
INNER = 3
"""Pixels from a depth edge where layers are not measured: there the two photos may see different things."""
JUMPS = (1.05, 1.10, 1.15, 1.20, 1.25)
"""Ratios of neighbouring depths that are edges; from Depth Pro (Bochkovskii et al. 2024)."""


@dataclass(frozen=True)
class Similarity:
    """x -> scale * rotation x + shift, from the scene's world to the true one."""

    scale: float
    rotation: Float[np.ndarray, "3 3"]
    shift: Float[np.ndarray, " 3"]

    def viewmat(self, true: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
        """The scene's pose of a camera in the true world; its depths times `scale` are metres."""
        moved = np.eye(4)
        moved[:3, :3] = true[:3, :3] @ self.rotation
        moved[:3, 3] = (true[:3, :3] @ self.shift + true[:3, 3]) / self.scale
        return moved


def points_of(view: DepthView) -> Float[np.ndarray, "H W 3"]:
    """World points under the pixels; a camera's own place where the depth is 0."""
    height, width = view.depths.shape
    v, u = np.mgrid[:height, :width] + 0.5
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(view.K).T
    return (rays * view.depths[..., None] - view.viewmat[:3, 3]) @ view.viewmat[:3, :3]


def fitted_similarity(
    points: Float[np.ndarray, "n 3"], truth: Float[np.ndarray, "n 3"], lengths: Float[np.ndarray, " n"]
) -> Similarity:
    """The similarity that brings points to their true places, by least absolute relative error.

    Poses and depths of a scene are right up to a similarity; the rest is error. Absolute errors keep one
    wrong photo, or a wrong wall, from pulling the others away.

    Args:
        points: of the scene. truth: the same surface points, m. lengths: their depths, m: errors count
            relative to them.

    Source: Umeyama 1991, with iteratively reweighted least squares.

    Raises:
        ValueError: fewer than three points.
    """
    if len(points) < 3:
        raise ValueError(f"points: expected at least 3, received {len(points)}")
    weights = 1 / lengths**2
    found = _weighted(points, truth, weights)
    for _ in range(20):
        moved = points @ (found.scale * found.rotation).T + found.shift
        errors = np.linalg.norm(moved - truth, axis=1) / lengths
        found = _weighted(points, truth, 1 / (lengths**2 * np.maximum(errors, 1e-3)))
    return found


def _weighted(points: np.ndarray, truth: np.ndarray, weights: np.ndarray) -> Similarity:
    shares = weights / weights.sum()
    middle, true_middle = shares @ points, shares @ truth
    centred, true_centred = points - middle, truth - true_middle
    u, strengths, vt = np.linalg.svd((true_centred * shares[:, None]).T @ centred)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * signs) @ vt
    spread = float(shares @ (centred**2).sum(1))
    scale = float((strengths * signs).sum()) / max(spread, 1e-12)
    return Similarity(scale, rotation, true_middle - scale * rotation @ middle)


def seen_by(view: DepthView, photos: Sequence[DepthView], tolerance: float = SAME) -> Bool[np.ndarray, "H W"]:
    """Pixels whose true surface at least one photo sees: inside its picture and not hidden there."""
    seen = np.zeros(view.depths.shape, dtype=bool)
    for photo in photos:
        z, there, inside = _looked_up(view, photo)
        seen |= inside & (np.abs(there - z) < tolerance * z)
    return seen


def _looked_up(
    view: DepthView, photo: DepthView
) -> tuple[Float[np.ndarray, "H W"], Float[np.ndarray, "H W"], Bool[np.ndarray, "H W"]]:
    """Per pixel of a view: depth in the photo, what the photo has there, and whether it is in its picture."""
    z, u, v, inside = _projected(view, photo)
    return z, photo.depths[np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)], inside


def _projected(view: DepthView, photo: DepthView):
    height, width = photo.depths.shape
    z, u, v, valid = reproject(
        view.depths, np.stack([view.viewmat, photo.viewmat]), np.stack([view.K, photo.K])
    )
    inside = valid & (z > 0.05) & (u >= 0) & (v >= 0) & (u < width) & (v < height)
    return z, u, v, inside


def levelled(truth: Float[np.ndarray, "H W"], drawn: Float[np.ndarray, "H W"]) -> Float[np.ndarray, "H W"]:
    """True depths of a photo brought to where the scene has the same surfaces: its edges, the scene's level.

    Each true depth is multiplied by the median of drawn / true over the same surface around it: pixels up
    to `REACH` away whose true depths differ by less than `EMPTY`. So a thing that is whole but at a wrong
    depth is where it should be, and only what hangs between things is not. 1 where nothing is drawn.
    """
    radius, step = REACH, REACH // 2
    ratios = np.where((truth > 0) & (drawn > 0), drawn / np.maximum(truth, 1e-9), np.nan)
    height, width = truth.shape
    wide, deep = (np.pad(m, radius, constant_values=np.nan) for m in (ratios, truth))
    around = np.full((((2 * radius) // step + 1) ** 2, height, width), np.nan)
    places = [(r, c) for r in range(0, 2 * radius + 1, step) for c in range(0, 2 * radius + 1, step)]
    for own, (row, column) in zip(around, places, strict=True):
        near = deep[row : row + height, column : column + width]
        same = np.abs(near - truth) < EMPTY * truth
        own[same] = wide[row : row + height, column : column + width][same]
    count = np.isfinite(around).sum(0)
    ordered = np.sort(around, axis=0)  # NaN last
    middle = np.take_along_axis(ordered, (np.maximum(count - 1, 0) // 2)[None], 0)[0]
    return truth * np.where(count > 0, middle, 1.0)


def sheets(
    drawn: DepthView, truth: Float[np.ndarray, "H W"], photos: Sequence[DepthView]
) -> Bool[np.ndarray, "H W"]:
    """Pixels that show a sheet: something hung between a thing's edge and what is behind it.

    A drawn point is one where (1) it is in empty space, so no true surface of the view within `BESIDE`
    pixels is within `EMPTY` of its depth; and (2) in a photo it falls between a foreground and its
    background, so within `ACROSS` pixels there are surfaces nearer than it by `BETWEEN` and farther by
    that, and none in between. The second tells sheets from surfaces at a wrong depth, the first from true
    sides of things that a photo sees edge on.

    Args:
        drawn: depths of the scene, m, 0 where it covers less than half. truth: true depths of the view.
        photos: their `levelled` depths.
    """
    known = (drawn.depths > 0) & (truth > 0)
    empty = known & ~_matched(drawn.depths, truth, BESIDE)
    found = np.zeros_like(empty)
    candidates = DepthView(np.where(empty, drawn.depths, 0.0), drawn.viewmat, drawn.K)
    for photo in photos:
        z, u, v, inside = _projected(candidates, photo)
        around = _windows(photo.depths, u[inside], v[inside], ACROSS)
        depth = z[inside][:, None]
        nearer = ((around > 0) & (around * (1 + BETWEEN) < depth)).any(1)
        farther = (around > depth * (1 + BETWEEN)).any(1)
        there = (around * (1 + BETWEEN) >= depth) & (around <= depth * (1 + BETWEEN))
        found[inside] |= nearer & farther & ~there.any(1)
    return found


def _matched(drawn: np.ndarray, truth: np.ndarray, radius: int) -> Bool[np.ndarray, "H W"]:
    """Pixels with a true depth within `radius` pixels and within `EMPTY`."""
    height, width = truth.shape
    wide = np.pad(truth, radius)
    near = np.zeros(truth.shape, dtype=bool)
    for row in range(2 * radius + 1):
        for column in range(2 * radius + 1):
            other = wide[row : row + height, column : column + width]
            near |= (other > 0) & (np.maximum(drawn, other) < (1 + EMPTY) * np.minimum(drawn, other))
    return near


def _windows(depths: np.ndarray, u: np.ndarray, v: np.ndarray, radius: int) -> Float[np.ndarray, "n w"]:
    """Depths around pixels (n,), 0 outside of the picture."""
    steps = np.arange(-radius, radius + 1)
    rows = (v.astype(int)[:, None] + steps.repeat(len(steps))) + radius
    columns = (u.astype(int)[:, None] + np.tile(steps, len(steps))) + radius
    return np.pad(depths, radius)[rows, columns]


def layer_gaps(
    own: Float[np.ndarray, "H W"], other: Float[np.ndarray, "H W"], both: Bool[np.ndarray, "H W"]
) -> Float[np.ndarray, " n"]:
    """How far two photos' surfaces lie apart, relative to their depth, at pixels where both see one.

    Args:
        own, other: depths of what each photo brought, from one camera; 0 where it covers less than half.
        both: pixels whose true surface both photos see. Where one photo alone brought something, there
            is one surface: 0. Where none did, there is nothing to measure.
    """
    first, second = own[both], other[both]
    some = (first > 0) | (second > 0)
    first, second = first[some], second[some]
    gaps = np.abs(first - second) / np.maximum((first + second) / 2, 1e-9)
    return np.where((first > 0) & (second > 0), gaps, 0.0)


def shared_surface(view: DepthView, other: DepthView) -> Bool[np.ndarray, "H W"]:
    """Pixels whose true surface another photo sees too, `INNER` pixels or more from depth edges."""
    size = 2 * INNER + 1
    nearest = minimum_filter(np.where(view.depths > 0, view.depths, np.inf), size)
    farthest = maximum_filter(view.depths, size)
    return seen_by(view, [other]) & (farthest < (1 + EMPTY) * nearest)


def boundary_f1(drawn: Float[np.ndarray, "H W"], truth: Float[np.ndarray, "H W"]) -> float:
    """Depth edges of a scene against the true ones: F1, mean over `JUMPS`; NaN without a true edge.

    An edge lies between two neighbouring pixels whose depths differ by more than a ratio. It is right
    when the other map has one of the same direction within one pixel. Lengths do not matter.

    Source: Bochkovskii et al. 2024, "Depth Pro", with a pixel's tolerance as benchmarks of boundaries
    have it (Martin et al. 2004: .75 % of the diagonal, here 2 pixels).
    """
    scores = []
    for jump in JUMPS:
        hits = found = present = met = 0
        for axis in (0, 1):
            real, judged = _edges(truth, jump, axis)
            seen, _ = _edges(drawn, jump, axis)
            seen &= judged
            near = np.ones((3, 3), dtype=bool)
            hits += int((seen & binary_dilation(real, near)).sum())
            met += int((real & binary_dilation(seen, near)).sum())
            found, present = found + int(seen.sum()), present + int(real.sum())
        if present:
            precision, recall = hits / max(found, 1), met / present
            scores.append(2 * precision * recall / max(precision + recall, 1e-9))
    return float(np.mean(scores)) if scores else math.nan


def _edges(depths: np.ndarray, jump: float, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of neighbours along an axis with a jump, and those where both depths are known."""
    size = depths.shape[axis]
    first, second = depths.take(range(size - 1), axis), depths.take(range(1, size), axis)
    known = (first > 0) & (second > 0)
    return known & (np.maximum(first, second) > jump * np.minimum(first, second)), known


def turned_about(
    viewmat: Float[np.ndarray, "4 4"],
    pivot: Float[np.ndarray, " 3"],
    axis: Float[np.ndarray, " 3"],
    degrees: float,
) -> Float[np.ndarray, "4 4"]:
    """A camera carried around a pivot, which stays where it is in the picture.

    Args:
        axis: world direction, any length; the camera turns right-handed about it.
    """
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = math.radians(degrees)
    turn = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = turn, pivot - turn @ pivot
    return viewmat @ np.linalg.inv(moved)


def angle_between(
    viewmats: Iterable[Float[np.ndarray, "4 4"]], other: Float[np.ndarray, "4 4"], pivot: np.ndarray
) -> float:
    """Degrees at a surface point between a camera and the nearest of some others."""
    way = -other[:3, :3].T @ other[:3, 3] - pivot
    best = 180.0
    for viewmat in viewmats:
        own = -viewmat[:3, :3].T @ viewmat[:3, 3] - pivot
        cosine = float(way @ own / max(np.linalg.norm(way) * np.linalg.norm(own), 1e-9))
        best = min(best, math.degrees(math.acos(min(max(cosine, -1.0), 1.0))))
    return best


def quantile(values: Float[np.ndarray, " n"], share: float) -> float:
    """NaN of nothing."""
    return float(np.quantile(values, share)) if len(values) else math.nan
