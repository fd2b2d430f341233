"""Depth of what the maps have missed, near and thin things most of all: a lamp that hangs before a wall.

Registration follows a surface to a fraction of a pixel from where the map nearly is; what stands at half
the wall's depth is out of its reach. Here each photo is compared with its neighbours on planes over the
whole range of depths. A pixel takes the depth of another plane where windows around it then look clearly
more alike, in the two neighbours that show it best, and where at least two neighbours say the same of that
point. Such pixels are few and lie at edges, so a smooth correction carries them over what the photo shows
as one thing and stops at its edges (`registration.smooth`).

Sizes: V views, H W pixels of the maps and of the pictures that are compared, P planes.

Source: plane sweep (Collins 1996), the best of several neighbours (Kang, Szeliski, Chai 2001), agreement
between photos (Merrell et al. 2007).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from langflash_core.depth.registration import resize_photo, smooth
from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.rig.neighbours import Neighbours
from langflash_core.rig.projected import project_points
from langflash_core.rig.rig import Rig
from langflash_core.rig.settings import PLANE_SWEEP, PlaneSweep


@dataclass(frozen=True)
class _Found:
    """Of a view at (H, W): log depths of the best planes; where those are another thing than the map has; and
    where the map's own depth shows the same in the neighbours."""

    log_depths: Float[np.ndarray, "H W"]
    other: Bool[np.ndarray, "H W"]
    confirmed: Bool[np.ndarray, "H W"]


def sweep_planes(
    rig: Rig,
    photos: Sequence[UInt8[np.ndarray, "_ _"]],
    neighbours: Neighbours,
    check: Callable[[], None] = lambda: None,
    settings: PlaneSweep = PLANE_SWEEP,
) -> Rig:
    """Depths with what a plane over the whole range explains better; a view with fewer than two neighbours
    stays as it is.

    Args:
        rig: on the processor. photos: (_, _) uint8, grey, of each view, the rig's photos at any size.
        neighbours: of each view.
        check: called before each view is looked at; what it raises ends the work.
    """
    greys = [resize_photo(photo, rig.size) for photo in photos]
    scene = _Scene(greys, list(rig.log_depths.numpy()), rig.viewmats.double(), rig.Ks.double())
    found = []
    for view, others in enumerate(neighbours):
        check()
        found.append(_sweep_view(scene, view, others, settings=settings))
    changed = [
        own + _carried_over(scene, view, found, of, settings=settings)
        for view, (own, of) in enumerate(zip(rig.log_depths, neighbours, strict=True))
    ]
    return rig.with_logs(torch.stack(changed))


@dataclass(frozen=True)
class _Scene:
    """What is compared: pictures (H, W) uint8; log depths; poses and intrinsics, float64."""

    greys: list[UInt8[np.ndarray, "H W"]]
    log_depths: list[Float[np.ndarray, "H W"]]
    viewmats: Float[Tensor, "V 4 4"]
    Ks: Float[Tensor, "V 3 3"]

    @property
    def size(self) -> tuple[int, int]:
        height, width = self.greys[0].shape
        return height, width

    def pose(self, view: int, other: int) -> Float[Tensor, "4 4"]:
        """From the camera of a view into that of another."""
        return self.viewmats[other] @ invert_rigid(self.viewmats[view])

    def seen(
        self, view: int, other: int, log_depths: Float[np.ndarray, "H W"]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where the pixels of a view lie in another's picture at these depths, x and y (H, W), far outside
        where that sees nothing of them, and their log depths there."""
        points = unproject(torch.from_numpy(log_depths).double().exp(), self.Ks[view]).flatten(0, 1).T
        there = project_points(points, self.pose(view, other), self.Ks[other], self.size)
        x, y, z, inside = (v.view(self.size).numpy() for v in (there.x, there.y, there.z, there.inside))
        x, y = (np.where(inside, along, -1e4).astype(np.float32) for along in (x, y))
        return x, y, np.log(np.maximum(z, 1e-6))


class _Windows:
    """Correlations of a picture (H, W) with others, window by window."""

    def __init__(self, grey: UInt8[np.ndarray, "H W"], settings: PlaneSweep = PLANE_SWEEP):
        self._grey = grey.astype(np.float32)
        self._mean = _mean(self._grey, settings=settings)
        self._variance = np.maximum(_mean(self._grey**2, settings=settings) - self._mean**2, 0)

    def alike(
        self, other: UInt8[np.ndarray, "H W"], settings: PlaneSweep = PLANE_SWEEP
    ) -> Float[np.ndarray, "H W"]:
        """Normalised cross-correlation, in [-1, 1]; towards 0 where there is no more than noise."""
        values = other.astype(np.float32)
        mean = _mean(values, settings=settings)
        variance = np.maximum(_mean(values * values, settings=settings) - mean * mean, 0)
        both = _mean(self._grey * values, settings=settings) - self._mean * mean
        return both / np.sqrt(self._variance * variance + settings.noise**4)


def _mean(values: np.ndarray, settings: PlaneSweep = PLANE_SWEEP) -> np.ndarray:
    return cv2.blur(values, (2 * settings.reach + 1,) * 2)


def _sweep_view(
    scene: _Scene, view: int, others: Sequence[int], settings: PlaneSweep = PLANE_SWEEP
) -> _Found:
    """What the neighbours say of one view."""
    if len(others) < settings.votes:
        nothing = np.zeros(scene.size, bool)
        return _Found(scene.log_depths[view], nothing, nothing)
    windows, own = _Windows(scene.greys[view], settings), scene.log_depths[view]
    now = _best(
        [windows.alike(_warp_neighbour(scene, view, other, own), settings=settings) for other in others]
    )
    inverse = _planes(own, settings=settings)
    volume = [
        _best([windows.alike(p, settings=settings) for p in _on_plane(scene, view, others, r)])
        for r in inverse.tolist()
    ]
    best, most = _largest(volume)
    found = -np.log(_peaks(volume, best, inverse)).astype(np.float32)
    other = (
        (most > settings.alike)
        & (most - now > settings.better)
        & (np.abs(found - own) > settings.other)
        & np.isfinite(own)
    )
    return _Found(found, other, now > settings.alike)


def _planes(
    log_depths: Float[np.ndarray, "H W"], settings: PlaneSweep = PLANE_SWEEP
) -> Float[np.ndarray, " P"]:
    """Inverse depths, in equal steps: the same shift in a neighbour's picture from each to the next."""
    near, far = np.exp(np.quantile(log_depths.astype(np.float64), (0.01, 0.99)))
    return np.linspace(1 / far, settings.nearer / near, settings.planes)


def _best(alike: list[np.ndarray]) -> np.ndarray:
    """Mean correlation of the two best neighbours, smoothed over the next pixels."""
    first, second = alike[0], np.full_like(alike[0], -1.0)
    for own in alike[1:]:
        second = np.maximum(second, np.minimum(first, own))
        first = np.maximum(first, own)
    return cv2.blur((first + second) / 2, (3, 3))


def _largest(volume: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The number of the most alike plane of each pixel, and how alike it is."""
    best, most = np.zeros(volume[0].shape, np.intp), volume[0].copy()
    for number, own in enumerate(volume):
        better = own > most
        best[better] = number
        np.maximum(most, own, out=most)
    return best, most


def _peaks(
    volume: list[np.ndarray], best: np.ndarray, inverse: Float[np.ndarray, " P"]
) -> Float[np.ndarray, "H W"]:
    """Inverse depths of the most alike planes, between planes by the parabola through three."""
    shift = np.zeros(best.shape)
    for number in range(1, len(volume) - 1):
        there = best == number
        before, here, after = (own[there] for own in volume[number - 1 : number + 2])
        bend = np.minimum(before - 2 * here + after, -1e-6)
        shift[there] = np.clip((before - after) / bend / 2, -0.5, 0.5)
    return inverse[best] + shift * (inverse[1] - inverse[0])


def _warp_neighbour(scene: _Scene, view: int, other: int, log_depths: np.ndarray) -> UInt8[np.ndarray, "H W"]:
    """A neighbour's picture as the view sees it, by these depths; 0 outside."""
    x, y, _ = scene.seen(view, other, log_depths)
    return cv2.remap(scene.greys[other], x - 0.5, y - 0.5, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)


def _on_plane(scene: _Scene, view: int, others: Sequence[int], inverse: float) -> list[np.ndarray]:
    """The same of all neighbours on one plane before the view: by the homography K' (R + t n^T / z) K^-1;
    0 where a corner lies behind the neighbour."""
    height, width = scene.size
    corners = np.array([[0, 0, 1], [width, 0, 1], [0, height, 1], [width, height, 1]], np.float64).T
    to_centres = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    brought = []
    for other in others:
        pose = scene.pose(view, other)
        on_plane = pose[:3, :3].clone()
        on_plane[:, 2] += pose[:3, 3] * inverse
        there = (scene.Ks[other] @ on_plane @ torch.linalg.inv(scene.Ks[view])).numpy()
        if (there @ corners)[2].min() <= 0:
            brought.append(np.zeros(scene.size, np.uint8))
            continue
        places = np.linalg.inv(to_centres) @ there @ to_centres
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        brought.append(cv2.warpPerspective(scene.greys[other], places, (width, height), flags=flags))
    return brought


def _confirmed_pixels(
    scene: _Scene,
    view: int,
    found: Sequence[_Found],
    others: Sequence[int],
    settings: PlaneSweep = PLANE_SWEEP,
) -> Bool[np.ndarray, "H W"]:
    """Where a view shows another thing than its map, and enough neighbours have the same place, on their own
    best planes or in their maps."""
    votes = np.zeros(scene.size, np.int32)
    height, width = scene.size
    for other in others:
        x, y, log_z = scene.seen(view, other, found[view].log_depths)
        inside = x >= 0
        column, row = (np.clip(at.astype(int), 0, most - 1) for at, most in ((x, width), (y, height)))
        theirs = (maps[row, column] for maps in (found[other].log_depths, scene.log_depths[other]))
        votes += inside & np.any([np.abs(own - log_z) < settings.same for own in theirs], 0)
    there = (found[view].other & (votes >= settings.votes)).astype(np.uint8)
    return cv2.morphologyEx(there, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0  # chance is a pixel wide


def _carried_over(
    scene: _Scene,
    view: int,
    found: Sequence[_Found],
    others: Sequence[int],
    settings: PlaneSweep = PLANE_SWEEP,
) -> Tensor:
    """The correction (H, W) of a map: what is found, 0 where the map is confirmed, between them as the
    photo's edges have it."""
    own, sure = scene.log_depths[view], 1 / (settings.error**2 * settings.smoothing.one_shift)
    there = _confirmed_pixels(scene, view, found, others, settings=settings)
    if not there.any():
        return torch.zeros(own.shape)
    change = np.where(there, found[view].log_depths - own, 0.0)
    target, weight = (
        torch.from_numpy((sure * values).astype(np.float32))
        for values in (change, there | found[view].confirmed)
    )
    guide = scene.greys[view].astype(np.float32)
    return smooth(target, weight, torch.from_numpy(own), guide, settings.smoothing)
