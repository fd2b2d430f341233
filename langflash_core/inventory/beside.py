"""Two scenes of one room: what came, what went, what moved.

Both stand level and along the room's walls, so one comes onto the other by one of four quarter turns, a
scale and a shift. Key points of the photos inside the scenes are matched; each is a place in its own scene,
by the depth drawn there; of many pairs of matches each tells a scale and a shift, and the turn, scale and
shift that most matches agree with win. What moved is in the minority there, like what matches wrongly.

What changed is told by depth, not by names, which may differ between the scenes. A thing is no longer where
it was where the other scene's photos look through the place of its surface at what is behind. What went from
the first scene and what came into the second are paired where they are called the same, or look the same to
the language, and are about one size: those moved. What is flat is not looked through; there a thing of the
same kind that is farther than `STAYS` of its own width moved. What no photo of the other scene looks at
nobody knows.
Sizes: n matches, m points.
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
from langflash_core.scene.thin import covered_areas
from langflash_core.scene.world import turn_of
from langflash_core.segments import evenly
from langflash_core.types import Camera, Frame

Render = Callable[..., Frame]  # (scene, camera, weight_maps=True)
STAYS = 0.35
"""Share of a thing's width by which it may seem to move, and stayed; at least `_STILL`."""
_STILL = 0.12  # m
_ALIKE = 0.5  # share by which widths and heights of one thing may differ between two scenes
_FLAT = 0.12  # m
_KNOWN, _GONE = 0.3, 0.5
"""Of a thing's surface: that has to be seen, and of that, what is looked through where the thing is not."""
_SPARE = (0.08, 0.05)  # m, and share of depth, by which a surface may be off
_SAME_LOOK = 0.8  # cosine of what two things say
_LOOKS = 2.0  # m of way, that a cosine lower by 1 weighs as much as
_SURFACE = 2000  # points of a thing, about
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
    """What changed from the first scene to the second; `unseen`: of the first, where no photo of the second
    looks, or something is there that it has no name for, so nobody knows."""

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
    metre = _metre(first)
    back, here = _Looks(second, fit, render, metre), _Looks(first, None, render, metre)
    old = [_Seen(thing, thing, _look(first, thing), back.states(first, thing)) for thing in first.things]
    new = [
        _Seen(thing, _placed(thing, fit), _look(second, thing), here.states(second, thing, fit))
        for thing in second.things
    ]
    moved = _paired([one for one in old if one.absent], [one for one in new if one.absent], metre, far=True)
    here_still = _paired(
        [one for one in old if not one.absent], [one for one in new if not one.absent], metre, far=False
    )
    flat = [pair for pair in here_still if _flat(pair.before, metre) and pair.by > _still(pair.before, metre)]
    stayed = [pair for pair in here_still if pair not in flat]
    paired = {pair.before.id for pair in (*moved, *here_still)}
    has = {pair.after.id for pair in (*moved, *here_still)}
    left = [one for one in old if one.thing.id not in paired]
    return Difference(
        fit, tuple(stayed), (*moved, *flat),
        tuple(one.thing for one in left if one.absent),
        tuple(one.thing for one in new if one.absent and one.thing.id not in has),
        tuple(one.thing for one in left if not one.absent), first.unit,
    )  # fmt: skip


def _metre(found: Inventory) -> float:
    """In the inventory's unit; of one without a scale, by how far its surface spreads in rooms."""
    return 1.0 if found.unit == "m" else float(found.stands[:, [0, 2]].std() / 1.2)


def _still(thing: Thing, metre: float) -> float:
    return max(_STILL * metre, STAYS * thing.size[0])


def _flat(thing: Thing, metre: float) -> bool:
    """Whether what is behind it is too near to be told from it."""
    return min(thing.size) < _FLAT * metre


def aligned(first: Inventory, second: Inventory, render: Render) -> Fit:
    """Raises:
    InputError: a scene holds no photos, or too few of their key points match.
    """
    for found in (first, second):
        if not found.scene.photos:
            raise InputError("scenes are compared by their photos, and one has none; name scenes of photos")
    ours, theirs = _matched(_described(first, render), _described(second, render))
    fit = _fitted(ours, theirs, _metre(first))
    if fit is None or fit.matches < _LEAST:
        raise InputError(
            "the photos of both scenes show too little in common; take some from the same places"
        )
    return fit


def _described(found: Inventory, render: Render) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) in the world of all photos' key points, and their descriptors (n, 128)."""
    places: list[np.ndarray] = [np.zeros((0, 3))]
    descriptors: list[np.ndarray] = [np.zeros((0, 128), np.float32)]
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
        descriptors.append(described[whole].astype(np.float32))
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


def _look(found: Inventory, thing: Thing) -> Float[np.ndarray, " C"]:
    """What a thing's surface says on average, unit length."""
    semantics = found.scene.semantics
    rows = np.flatnonzero(thing.rows)
    areas = covered_areas(found.scene.gaussians)[rows]
    weights = semantics.weight_values.double().numpy()[rows] * (areas + 1e-12)[:, None]
    ids = semantics.weight_ids.numpy()[rows]
    mean = np.bincount(ids.ravel(), weights.ravel(), semantics.num_atoms)
    vector = mean @ np.nan_to_num(semantics.dictionary.double().numpy())
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


@dataclass(frozen=True)
class _Seen:
    """A thing, as it stands in the first world, its look, and the shares of its surface that the other scene
    shows, and looks through."""

    thing: Thing
    placed: Thing
    look: Float[np.ndarray, " C"]
    states: tuple[float, float]

    @property
    def absent(self) -> bool:
        """Whether it is not in the other scene, where this one has it."""
        known, through = self.states
        return known >= _KNOWN and through >= _GONE * known


def _paired(before: Sequence[_Seen], after: Sequence[_Seen], metre: float, *, far: bool) -> list[Pair]:
    """Things that may be the same, so that the sum of their differences is least.

    Args:
        far: they are alike in name or look, and size; else they are near, or of one name and size.
    """
    never = 1e6
    costs = np.full((len(before), len(after)), never)
    for row, one in enumerate(before):
        for column, other in enumerate(after):
            way = math.dist(one.placed.place, other.placed.place)
            look, named = float(one.look @ other.look), one.thing.kind == other.thing.kind
            same = (named or (far and look >= _SAME_LOOK)) and _alike(one.placed, other.placed)
            if same or (not far and way <= _still(one.thing, metre)):
                costs[row, column] = way / metre + _LOOKS * (1 - look) + (not named)
    rows, columns = linear_sum_assignment(costs)
    return [
        Pair(before[r].thing, after[c].thing, math.dist(before[r].placed.place, after[c].placed.place))
        for r, c in zip(rows, columns, strict=True)
        if costs[r, c] < never
    ]


def _alike(one: Thing, other: Thing) -> bool:
    """Whether both may be the same thing: what a photo's border cuts has no size."""
    if one.cut or other.cut:
        return True
    sides = ((one.size[0], other.size[0]), (one.size[2], other.size[2]))
    return all(abs(a - b) <= _ALIKE * max(a, b) for a, b in sides)


class _Looks:
    """What photos of a scene show at places of the first world."""

    def __init__(self, found: Inventory, fit: Fit | None, render: Render, metre: float):
        self._found, self._fit, self._metre = found, fit, metre
        scene = found.scene
        self._cameras = [scene.camera(view) for view in range(scene.num_views)]
        frames = [render(scene, camera, weight_maps=False) for camera in self._cameras]
        self._depths = [
            np.where(frame.alphas.cpu().numpy() >= COVERED_ALPHA, frame.depths.cpu().double().numpy(), 0.0)
            for frame in frames
        ]

    def states(self, whose: Inventory, thing: Thing, fit: Fit | None = None) -> tuple[float, float]:
        """Shares of a thing's surface that some photo shows, or looks through at what is behind.

        Args:
            fit: from the thing's own world to the first, if it is another.
        """
        own = np.flatnonzero(thing.rows)
        chosen = own[evenly(covered_areas(whose.scene.gaussians)[own])]
        points = whose.stands[chosen[:: max(1, len(chosen) // _SURFACE)]]
        points = points if fit is None else fit.placed(points)
        if self._fit is not None:
            points = (points - self._fit.shift) @ self._fit.turn / self._fit.scale
        world = self._found.world
        inside = points / self._found.scale @ turn_of(world) + np.array(world.origin)
        behind, known = np.zeros(len(inside), bool), np.zeros(len(inside), bool)
        for camera, depths in zip(self._cameras, self._depths, strict=True):
            through, met = self._one(camera, depths, inside)
            behind, known = behind | through, known | through | met
        return float(known.mean()), float(behind.mean())

    def _one(self, camera: Camera, depths: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m,) whether a camera looks through each point, and whether it shows a surface there."""
        viewmat, K = camera.viewmat.double().numpy(), camera.K.double().numpy()
        pos_c = points @ viewmat[:3, :3].T + viewmat[:3, 3]
        with np.errstate(all="ignore"):
            columns, rows = np.nan_to_num((pos_c / pos_c[:, 2:]) @ K[:2].T, nan=-1.0).T
        height, width = depths.shape
        good = (pos_c[:, 2] > 0) & (columns >= 0) & (rows >= 0) & (columns < width) & (rows < height)
        seen = np.zeros(len(points))
        seen[good] = depths[rows[good].astype(int), columns[good].astype(int)]
        spare = _SPARE[0] * self._metre / (self._found.scale * (self._fit.scale if self._fit else 1.0))
        spare = spare + _SPARE[1] * np.abs(pos_c[:, 2])
        through = good & (seen > pos_c[:, 2] + spare)
        return through, good & (seen > 0) & (np.abs(seen - pos_c[:, 2]) <= spare)
