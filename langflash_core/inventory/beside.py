"""Two scenes of one room: what came, what went, what moved.

Both stand level and along the room's walls, so one comes onto the other by one of four quarter turns, a
scale and a shift. Key points of the photos inside the scenes are matched; each is a place in its own scene,
by the depth drawn there; of many pairs of matches each tells a scale and a shift, and the turn, scale and
shift that most matches agree with win. What moved is in the minority there, like what matches wrongly.

Then things of one kind are paired, the nearest first: what is within `STAYS` of its own size stayed, what is
farther moved. What has no partner came or went, but only where a photo of the other scene looks at its place;
else nobody knows. Sizes: n matches.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from jaxtyping import Float
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.inventory.things import Inventory, Thing
from langflash_core.language.answers import COVERED_ALPHA
from langflash_core.picture_files import STORED, opened_picture
from langflash_core.scene.world import turn_of
from langflash_core.types import Camera, Frame

Render = Callable[..., Frame]  # (scene, camera, weight_maps=True)
STAYS = 0.35
"""Share of a thing's width by which it may seem to move, and stayed; at least `_STILL`."""
_STILL = 0.12  # m
_ALIKE = 0.5  # share by which widths and heights of one thing may differ between two scenes
_RATIO = 0.8  # Lowe's, of matches
_POINTS = 3000  # of a photo
_LEAST = 12  # matches that agree
_NEAR = 0.12  # m: how well they agree
_TRIES = 4000


@dataclass(frozen=True)
class Fit:
    """From places of the second inventory's world to the first's: scale turn p + shift. matches: that agree,
    of how many (`tried`)."""

    turn: Float[np.ndarray, "3 3"] = field(repr=False)
    scale: float
    shift: Float[np.ndarray, " 3"] = field(repr=False)
    matches: int
    tried: int

    def placed(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points of the second world in the first."""
        return self.scale * points @ self.turn.T + self.shift


@dataclass(frozen=True)
class Pair:
    """A thing that both scenes have. by: how far its middle moved, in the first's unit."""

    before: Thing
    after: Thing
    by: float


@dataclass(frozen=True)
class Difference:
    """What changed from the first scene to the second; `unseen`: where a photo of the other scene did not
    look, so nobody knows."""

    fit: Fit
    stayed: tuple[Pair, ...]
    moved: tuple[Pair, ...]
    went: tuple[Thing, ...]
    came: tuple[Thing, ...]
    unseen: tuple[Thing, ...]
    unit: str


def difference(first: Inventory, second: Inventory, render: Render) -> Difference:
    """What became of the things of the first scene.

    Args:
        render: draws depth of a scene from a camera.

    Raises:
        InputError: a scene holds no photos, or their photos show no common room.
    """
    fit = aligned(first, second, render)
    placed = [_placed(thing, fit) for thing in second.things]
    metre = 1.0 if first.unit == "m" else first.stands[:, [0, 2]].std() / 1.2
    pairs, left, new = _paired(first.things, placed, metre)
    stayed, moved = [], []
    for before, after, by in pairs:
        still = by <= max(_STILL * metre, STAYS * before.size[0])
        (stayed if still else moved).append(Pair(before, second.things[placed.index(after)], by))
    back = _Looks(second, fit, render), _Looks(first, None, render)
    went = [thing for thing in left if back[0].see(thing)]
    came = [after for after in new if back[1].see(after)]
    known = {thing.id for thing in went}
    unseen = [thing for thing in left if thing.id not in known]
    return Difference(
        fit, tuple(stayed), tuple(moved), tuple(went),
        tuple(second.things[placed.index(after)] for after in came), tuple(unseen), first.unit,
    )  # fmt: skip


def aligned(first: Inventory, second: Inventory, render: Render) -> Fit:
    """Raises:
    InputError: a scene holds no photos, or too few of their key points match.
    """
    for found in (first, second):
        if not found.scene.photos:
            raise InputError("scenes are compared by their photos, and one has none; name scenes of photos")
    ours, theirs = _matched(_described(first, render), _described(second, render))
    fit = _fitted(ours, theirs, 1.0 if first.unit == "m" else first.stands[:, [0, 2]].std() / 1.2)
    if fit is None or fit.matches < _LEAST:
        raise InputError(
            "the photos of both scenes show too little in common; take some from the same places"
        )
    return fit


def _described(found: Inventory, render: Render) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) in the world of all photos' key points, and their descriptors (n, 128)."""
    places, descriptors = [np.zeros((0, 3))], [np.zeros((0, 128), np.float32)]
    sift = cv2.SIFT.create(_POINTS, contrastThreshold=0.01)
    for view, photo in enumerate(found.scene.photos):
        try:
            with opened_picture(photo, STORED) as opened:
                grey = np.asarray(opened.convert("L"))
        except (OSError, SyntaxError, ValueError):
            continue
        points, described = sift.detectAndCompute(np.ascontiguousarray(grey), None)
        if described is None:
            continue
        camera = found.scene.camera(view)
        frame = render(found.scene, camera, weight_maps=False)
        pixels = np.array([point.pt for point in points]) + 0.5
        pixels *= np.array([camera.width / grey.shape[1], camera.height / grey.shape[0]])
        own, whole = _world_places(found, camera, frame, pixels)
        places.append(own[whole])
        descriptors.append(described[whole])
    return np.concatenate(places), np.concatenate(descriptors)


def _world_places(
    found: Inventory, camera: Camera, frame: Frame, pixels: Float[np.ndarray, "n 2"]
) -> tuple[np.ndarray, np.ndarray]:
    """Where pixels are in the world, and which show something."""
    columns, rows = pixels.astype(int).T
    columns, rows = columns.clip(0, camera.width - 1), rows.clip(0, camera.height - 1)
    depths = frame.depths.cpu().double().numpy()[rows, columns]
    covered = frame.alphas.cpu().numpy()[rows, columns] >= COVERED_ALPHA
    rays = np.concatenate((pixels, np.ones((len(pixels), 1))), 1) @ np.linalg.inv(camera.K.double().numpy()).T
    pose = invert_rigid(camera.viewmat.double()).cpu().numpy()
    points = (rays * depths[:, None]) @ pose[:3, :3].T + pose[:3, 3]
    return _stood(found, points), covered & (depths > 0)


def _stood(found: Inventory, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Points of the scene in its world, in the inventory's unit."""
    return found.scale * (points - np.array(found.world.origin)) @ turn_of(found.world).T


def _matched(ours, theirs) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) of key points that are each other's nearest, in both worlds."""
    if min(len(ours[1]), len(theirs[1])) < 2:
        return np.zeros((0, 3)), np.zeros((0, 3))
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    there = {
        m.queryIdx: m.trainIdx
        for m, n in matcher.knnMatch(ours[1], theirs[1], k=2)
        if m.distance < _RATIO * n.distance
    }
    back = {m.queryIdx: m.trainIdx for (m,) in matcher.knnMatch(theirs[1], ours[1], k=1)}
    both = [(a, b) for a, b in there.items() if back.get(b) == a]
    rows = np.array(both, int).reshape(-1, 2)
    return ours[0][rows[:, 0]], theirs[0][rows[:, 1]]


def _fitted(ours: Float[np.ndarray, "n 3"], theirs: Float[np.ndarray, "n 3"], metre: float) -> Fit | None:
    """The quarter turn, scale and shift that most matches agree with, then exact on those."""
    if len(ours) < 2:
        return None
    rng, best, chosen = np.random.default_rng(0), np.zeros(len(ours), bool), None
    pairs = rng.integers(len(ours), size=(_TRIES, 2))
    for quarter, (a, b) in itertools.product(range(4), pairs):
        turn = Rotation.from_euler("y", 90 * quarter, degrees=True).as_matrix()
        step, own = turn @ (theirs[b] - theirs[a]), ours[b] - ours[a]
        length = float(np.linalg.norm(step))
        if length < 0.3 * metre or own @ step < 0.98 * np.linalg.norm(own) * length:
            continue
        scale = float(np.linalg.norm(own)) / length
        if not 0.4 < scale < 2.5:
            continue
        shift = ours[a] - scale * turn @ theirs[a]
        agree = np.linalg.norm(scale * theirs @ turn.T + shift - ours, axis=1) < _NEAR * metre
        if agree.sum() > best.sum():
            best, chosen = agree, turn
    if chosen is None or best.sum() < 3:
        return None
    turn, scale, shift = _similarity(ours, theirs, best, metre)
    agree = np.linalg.norm(scale * theirs @ turn.T + shift - ours, axis=1) < _NEAR * metre
    return Fit(turn, scale, shift, int(agree.sum()), len(ours))


def _similarity(ours, theirs, agree, metre: float) -> tuple[np.ndarray, float, np.ndarray]:
    """Of least squares over the matches that agree, which are chosen anew a few times.

    Source: Umeyama 1991.
    """
    turn, scale, shift = np.eye(3), 1.0, np.zeros(3)
    for _ in range(4):
        if agree.sum() < 3:
            break
        a, b = ours[agree], theirs[agree]
        middle_a, middle_b = a.mean(0), b.mean(0)
        u, values, v = np.linalg.svd((a - middle_a).T @ (b - middle_b))
        signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
        turn = (u * signs) @ v
        scale = float((values * signs).sum() / ((b - middle_b) ** 2).sum())
        shift = middle_a - scale * turn @ middle_b
        agree = np.linalg.norm(scale * theirs @ turn.T + shift - ours, axis=1) < _NEAR * metre
    return turn, scale, shift


def _placed(thing: Thing, fit: Fit) -> Thing:
    """A thing of the second scene in the first's world."""
    place = fit.placed(np.array([thing.place]))[0]
    yaw = math.degrees(math.atan2(fit.turn[2, 0], fit.turn[0, 0]))
    width, depth, height = (fit.scale * side for side in thing.size)
    bottom = -float(place[1]) - height / 2
    return replace(
        thing, place=tuple(place.tolist()), size=(width, depth, height), turn=thing.turn + yaw, bottom=bottom
    )


def _paired(
    before: Sequence[Thing], after: Sequence[Thing], metre: float
) -> tuple[list[tuple[Thing, Thing, float]], list[Thing], list[Thing]]:
    """Things of one kind and about one size, so that the sum of their ways is least; and who is left over."""
    far = 1e6
    costs = np.full((len(before), len(after)), far)
    for row, one in enumerate(before):
        for column, other in enumerate(after):
            if one.kind == other.kind and _alike(one, other):
                costs[row, column] = math.dist(one.place, other.place) / metre
    rows, columns = linear_sum_assignment(costs)
    pairs = [
        (before[r], after[c], float(costs[r, c] * metre))
        for r, c in zip(rows, columns, strict=True)
        if costs[r, c] < far
    ]
    had, has = {one.id for one, _, _ in pairs}, {other.id for _, other, _ in pairs}
    return pairs, [t for t in before if t.id not in had], [t for t in after if t.id not in has]


def _alike(one: Thing, other: Thing) -> bool:
    """Whether both may be the same thing: what a photo's border cuts has no size."""
    if one.cut or other.cut:
        return True
    sides = ((one.size[0], other.size[0]), (one.size[2], other.size[2]))
    return all(abs(a - b) <= _ALIKE * max(a, b) for a, b in sides)


class _Looks:
    """Whether photos of a scene look at a place of the first world, and nothing stands before it."""

    def __init__(self, found: Inventory, fit: Fit | None, render: Render):
        self._found, self._fit = found, fit
        scene = found.scene
        self._cameras = [scene.camera(view) for view in range(scene.num_views)]
        self._frames = [render(scene, camera, weight_maps=False) for camera in self._cameras]

    def see(self, thing: Thing) -> bool:
        """Most of its box's corners and middle are in one of the photos, not behind what is seen there."""
        heights = -np.array([thing.bottom, thing.bottom + thing.size[2]])
        points = [[east, height, north] for east, north in thing.corners for height in heights]
        points = np.array([*points, thing.place])
        if self._fit is not None:
            points = (points - self._fit.shift) @ self._fit.turn / self._fit.scale
        world = self._found.world
        inside = points / self._found.scale @ turn_of(world) + np.array(world.origin)
        return any(
            self._share(camera, frame, inside) > 0.6
            for camera, frame in zip(self._cameras, self._frames, strict=True)
        )

    @staticmethod
    def _share(camera: Camera, frame: Frame, points: np.ndarray) -> float:
        viewmat, K = camera.viewmat.double().numpy(), camera.K.double().numpy()
        pos_c = points @ viewmat[:3, :3].T + viewmat[:3, 3]
        with np.errstate(all="ignore"):
            columns, rows = ((pos_c / pos_c[:, 2:]) @ K[:2].T).T
        good = (
            (pos_c[:, 2] > 0)
            & (columns >= 0)
            & (rows >= 0)
            & (columns < camera.width)
            & (rows < camera.height)
        )
        depths = frame.depths.cpu().double().numpy()
        seen = np.zeros(len(points), bool)
        seen[good] = pos_c[good, 2] <= 1.1 * depths[rows[good].astype(int), columns[good].astype(int)]
        return float(seen.mean())
