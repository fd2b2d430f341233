"""Cameras as people hold them. V views; OpenCV axes (+x right, +y down, +z forward), metres.

Proposals are judged on boxes, by casting a coarse grid of rays, before anything is drawn; the
drawn depth has the last word (`sample`).
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from langflash_core.lab.rooms.layout import Room

MIN_OVERLAP = 0.25
MIN_MEDIAN_DEPTH = 0.6
MAX_SHARE = 0.75
_GRID = 20
_HEIGHTS = ((1.45, 1.75), (1.0, 1.3), (0.75, 1.0))
_NEAR_SHARE = 0.3  # of all picture sets are taken of one thing, large or small, from near by
_FLAT = frozenset({"rug", "mat"})


@dataclass(frozen=True)
class CameraSet:
    """Cameras of one picture set: world (room, y up) -> camera, and intrinsics in pixels."""

    viewmats: Float[np.ndarray, "V 4 4"]
    Ks: Float[np.ndarray, "V 3 3"]


def propose_cameras(
    rng: np.random.Generator, room: Room, num_views: int, size: tuple[int, int], tries: int = 60
) -> CameraSet | None:
    """Views of shared content, 0.1-1.0 m and up to 45 degrees apart; the third lies about between
    the first two, so that it can judge what they reconstruct (as NoPoSplat's targets do).

    Args:
        rng: the only source of chance.
        room: where to stand.
        num_views: V, at least 1.
        size: (height, width), pixels.
        tries: proposals before giving up.

    Returns:
        Cameras that pass on boxes, or None.
    """
    boxes = _Boxes.of(room)
    K = _intrinsics(rng, size)
    for attempt in range(tries):
        first = _first_view(rng, room, boxes)
        if first is None or not _sees_enough(boxes, first, K, size, relaxed=attempt > tries // 2):
            continue
        views = [first]
        for _ in range(8 * num_views):
            if len(views) == num_views:
                return CameraSet(np.stack(views), np.repeat(K[None], num_views, axis=0))
            other = (
                _view_between(rng, room, boxes, first, views[1])
                if len(views) == 2
                else _next_view(rng, room, boxes, first)
            )
            if other is not None and _pair_is_good(boxes, first, other, K, size):
                views.append(other)
        if len(views) == num_views:
            return CameraSet(np.stack(views), np.repeat(K[None], num_views, axis=0))
    return None


def look_at(
    eye: Float[np.ndarray, " 3"], target: Float[np.ndarray, " 3"], roll: float = 0.0
) -> Float[np.ndarray, "4 4"]:
    """World -> camera, from a y-up world; `roll` in radians turns the camera about its axis."""
    forward = (target - eye) / max(float(np.linalg.norm(target - eye)), 1e-9)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= max(float(np.linalg.norm(right)), 1e-9)
    down = np.cross(forward, right)
    cos, sin = math.cos(roll), math.sin(roll)
    view = np.eye(4)
    view[:3, :3] = np.stack([cos * right + sin * down, cos * down - sin * right, forward])
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def overlap_fraction(
    depths: Float[np.ndarray, "2 H W"],
    viewmats: Float[np.ndarray, "2 4 4"],
    Ks: Float[np.ndarray, "2 3 3"],
    tolerance: float = 0.04,
) -> float:
    """Fraction of view-0 pixels that view 1 sees: inside its picture and not hidden there.

    Args:
        depths: z-depth, m; 0 where nothing.
        viewmats: world -> camera.
        Ks: pixels.
        tolerance: relative difference of depth that still counts as the same point.

    Returns:
        Share in [0, 1]; 0 when view 0 is empty.
    """
    z, u, v, valid = reproject(depths[0], viewmats, Ks)
    height, width = depths[1].shape
    inside = valid & (z > 0.05) & (u >= 0) & (v >= 0) & (u < width) & (v < height)
    seen = depths[1][np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)]
    same = inside & (np.abs(seen - z) < tolerance * z)
    return float(same.sum() / max(valid.sum(), 1))


def reproject(
    depth: Float[np.ndarray, "H W"], viewmats: Float[np.ndarray, "2 4 4"], Ks: Float[np.ndarray, "2 3 3"]
) -> tuple[
    Float[np.ndarray, "H W"], Float[np.ndarray, "H W"], Float[np.ndarray, "H W"], Bool[np.ndarray, "H W"]
]:
    """Pixels of view 0 as seen from view 1: z-depth (m), column, row (pixels), and which had a depth."""
    height, width = depth.shape
    v, u = np.mgrid[:height, :width] + 0.5
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(Ks[0]).T
    between = viewmats[1] @ np.linalg.inv(viewmats[0])
    points = (rays * depth[..., None]) @ between[:3, :3].T + between[:3, 3]
    z = points[..., 2]
    pixels = points @ Ks[1].T
    safe = np.where(np.abs(z) > 1e-6, z, 1e-6)
    return z, pixels[..., 0] / safe, pixels[..., 1] / safe, depth > 0


@dataclass(frozen=True)
class _Boxes:
    """What can be hit: boxes of things (and of the notch), and the room's own box from inside."""

    low: Float[np.ndarray, "M 3"]
    high: Float[np.ndarray, "M 3"]
    room: Float[np.ndarray, " 3"]

    @classmethod
    def of(cls, room: Room) -> "_Boxes":
        things = [i for i in room.instances if i.item >= 0 and i.group not in _FLAT and i.group != "window"]
        low, high = [i.low for i in things], [i.high for i in things]
        if room.shell.notch is not None:
            x0, z0, x1, z1 = room.shell.notch
            low.append(np.array([x0, 0.0, z0]))
            high.append(np.array([x1, room.shell.height, z1]))
        extent = np.array([room.shell.size[0], room.shell.height, room.shell.size[1]])
        if not low:
            low, high = [extent * 9], [extent * 9]
        return cls(np.stack(low), np.stack(high), extent)

    def blocks(self, point: Float[np.ndarray, " 3"], margin: float) -> bool:
        """Whether a point is within `margin` of a box, or outside the room."""
        near = np.all((point > self.low - margin) & (point < self.high + margin), axis=1).any()
        return bool(near or np.any(point < 0.2) or np.any(point > self.room - 0.2))

    def cast(
        self, view: Float[np.ndarray, "4 4"], rays: Float[np.ndarray, "R 3"]
    ) -> tuple[Float[np.ndarray, " R"], Int[np.ndarray, " R"]]:
        """z-depth of the first hit per ray (unit z in the camera) and its box; -1 for the room itself."""
        eye = -view[:3, :3].T @ view[:3, 3]
        directions = rays @ view[:3, :3]
        inverse = 1.0 / np.where(np.abs(directions) < 1e-9, 1e-9, directions)
        a, b = (self.low - eye) * inverse[:, None], (self.high - eye) * inverse[:, None]
        enter, leave = np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)
        hit = np.where((enter < leave) & (leave > 0), np.maximum(enter, 0.0), np.inf)
        walls = np.maximum(-eye * inverse, (self.room - eye) * inverse).min(-1)
        nearest = hit.argmin(1)
        depth = hit[np.arange(len(rays)), nearest]
        return np.minimum(depth, walls), np.where(depth < walls, nearest, -1)


def _intrinsics(rng: np.random.Generator, size: tuple[int, int]) -> Float[np.ndarray, "3 3"]:
    """Horizontal field of view 50-90 degrees on the longer side, square pixels, centred."""
    height, width = size
    focal = 0.5 * max(size) / math.tan(math.radians(float(rng.uniform(50, 90))) / 2)
    return np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1.0]])


def _first_view(rng: np.random.Generator, room: Room, boxes: _Boxes) -> Float[np.ndarray, "4 4"] | None:
    things = [i for i in room.instances if i.item >= 0 and i.group not in {"window", "switch", "socket"}]
    if not things:
        return None
    near = rng.random() < _NEAR_SHARE
    power = 0.1 if near else 0.4
    weights = np.array([float(np.prod(np.maximum(i.high - i.low, 0.05))) ** power for i in things])
    aim = things[int(rng.choice(len(things), p=weights / weights.sum()))]
    target = (aim.low + aim.high) / 2 + rng.normal(0, 0.25, 3)
    low, high = _HEIGHTS[int(rng.choice(3, p=[0.55, 0.3, 0.15]))]
    distance = rng.uniform(0.8, 1.8) if near else rng.uniform(1.0, 4.2)
    bearing = rng.uniform(0, 2 * math.pi)
    eye = np.array(
        [
            target[0] + distance * math.cos(bearing),
            rng.uniform(low, high),
            target[2] + distance * math.sin(bearing),
        ]
    )
    if not _stands_free(room, boxes, eye):
        return None
    target[1] = np.clip(target[1], eye[1] - 0.6 * distance, eye[1] + 0.25 * distance)
    return look_at(eye, target, float(rng.normal(0, math.radians(2.0))))


def _next_view(
    rng: np.random.Generator, room: Room, boxes: _Boxes, first: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "4 4"] | None:
    """A step of 0.1-1.0 m to the side or along, still looking about where the first view looked."""
    eye = -first[:3, :3].T @ first[:3, 3]
    step = rng.normal(0, 1, 3) * [1.0, 0.25, 1.0]
    step *= rng.uniform(0.1, 1.0) / max(float(np.linalg.norm(step)), 1e-9)
    other = eye + step
    if not _stands_free(room, boxes, other):
        return None
    reach = rng.uniform(1.2, 3.5)
    target = eye + first[2, :3] * reach + rng.normal(0, 0.12 * reach, 3) * [1.0, 0.5, 1.0]
    view = look_at(other, target, float(rng.normal(0, math.radians(2.0))))
    turn = math.degrees(math.acos(float(np.clip((np.trace(first[:3, :3] @ view[:3, :3].T) - 1) / 2, -1, 1))))
    return view if turn <= 45 else None


def _view_between(
    rng: np.random.Generator,
    room: Room,
    boxes: _Boxes,
    first: Float[np.ndarray, "4 4"],
    second: Float[np.ndarray, "4 4"],
) -> Float[np.ndarray, "4 4"] | None:
    """A camera on the way from one view to the other, a little off the straight line."""
    eyes = np.stack([-view[:3, :3].T @ view[:3, 3] for view in (first, second)])
    share = float(rng.uniform(0.2, 0.8))
    span = float(np.linalg.norm(eyes[1] - eyes[0]))
    eye = (1 - share) * eyes[0] + share * eyes[1] + rng.normal(0, 0.1 * span, 3)
    if not _stands_free(room, boxes, eye):
        return None
    forward = (1 - share) * first[2, :3] + share * second[2, :3] + rng.normal(0, 0.03, 3)
    return look_at(eye, eye + forward, float(rng.normal(0, math.radians(2.0))))


def stands_free(room: Room, eye: Float[np.ndarray, " 3"]) -> bool:
    """Whether a camera fits there: inside the room (its world), and 12 cm or more from every box."""
    return _stands_free(room, _Boxes.of(room), eye)


def _stands_free(room: Room, boxes: _Boxes, eye: Float[np.ndarray, " 3"]) -> bool:
    return not boxes.blocks(eye, 0.12) and room.shell.holds(eye, eye, 0.2)


def _grid_rays(K: Float[np.ndarray, "3 3"], size: tuple[int, int]) -> Float[np.ndarray, "R 3"]:
    v, u = np.mgrid[:_GRID, :_GRID] + 0.5
    u, v = u.ravel() * size[1] / _GRID, v.ravel() * size[0] / _GRID
    return np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T


def _sees_enough(
    boxes: _Boxes,
    view: Float[np.ndarray, "4 4"],
    K: Float[np.ndarray, "3 3"],
    size: tuple[int, int],
    relaxed: bool,
) -> bool:
    depth, hit = boxes.cast(view, _grid_rays(K, size))
    counts = np.bincount(hit[hit >= 0], minlength=1)
    variety = int((counts >= 3).sum())
    enough = variety >= (2 if relaxed else 5)
    return bool(enough and np.median(depth) > 0.9 and counts.max() < 0.6 * len(hit) and depth.min() > 0.12)


def _pair_is_good(
    boxes: _Boxes,
    first: Float[np.ndarray, "4 4"],
    other: Float[np.ndarray, "4 4"],
    K: Float[np.ndarray, "3 3"],
    size: tuple[int, int],
) -> bool:
    if not _sees_enough(boxes, other, K, size, relaxed=True):
        return False
    rays = _grid_rays(K, size)
    coarse = np.diag([_GRID / size[1], _GRID / size[0], 1.0]) @ K
    depths = np.stack([boxes.cast(view, rays)[0].reshape(_GRID, _GRID) for view in (first, other)])
    shared = overlap_fraction(depths, np.stack([first, other]), np.stack([coarse, coarse]), tolerance=0.15)
    return shared > MIN_OVERLAP + 0.05
