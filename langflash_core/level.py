"""A scene upright and true: which way is up, where its floor is, which way is north, and how large it may be.

Up is told by straight edges of the photos and by surfaces (`langflash_core/geometry/manhattan.py`), with what
answers "floor" for a first direction; the height of the floor by what answers it, or else by the lowest level
surface. North is the wall that the first photo looks at most squarely, so that a plan stands as the room is
seen. A scene has a unit of its own; how many metres that is, ceilings and doors tell, which are built to
measure, how high people hold cameras, and the network's depth, which was learned in metres: each with the
error that such things have, and the chance that the floor is none. A guess stays one until somebody tells a
length.

Sizes: n points of the scene's surface, V views, L edges.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float

from langflash_core.base.picture_files import decoded_photo
from langflash_core.base.records import Guess, World
from langflash_core.errors import InputError, LangFlashError
from langflash_core.geometry.lines import edge_planes
from langflash_core.geometry.manhattan import Directions, Sights, found_directions
from langflash_core.geometry.pinhole import see
from langflash_core.geometry.rotations import turn_of
from langflash_core.geometry.surfels import covered_areas, normals_of
from langflash_core.language.answers import world_points
from langflash_core.language.gaussians import gaussian_relevance
from langflash_core.language.relevance import compile_query
from langflash_core.language.spaces import language_space
from langflash_core.scene.world import transform_scene
from langflash_core.splat import render
from langflash_core.types import NO_LANGUAGE, Camera, Scene


@dataclass(frozen=True)
class Levelling:
    """How a scene stands, and how large it is."""

    samples: int = 6000
    """Points of the surface that are looked at."""
    share: float = 0.02
    """Of the surface, from which what answers a word is believed in."""
    level: float = math.cos(math.radians(30))
    """Cosine with up, of a surface that may be a floor or a ceiling."""
    window: float = 0.04
    """Of the scene's height: surfaces so near in height are one."""
    contradicted: float = 2.5
    """Deviations: what is farther from the guess did not tell it."""
    no_floor: float = 0.1
    """Of scenes, whose floor is a table top or the like: 8 of 100 held-out rooms, by their cameras."""
    table: float = 1.2
    """Metres, at most so far."""
    another: float = 1e-3
    """Odds that such a thing is another than it is called, to those of its exact height."""
    wide: float = 1.5
    """E-folds about the mean of what is told, within which the scale is sought."""
    both: float = 0.3
    """Of what answers "floor", from which what lies lower is the floor."""
    edge: float = 0.02
    """Of a picture's side: what reaches so near to its border may go on."""
    ceiling: tuple[float, float] = (2.6, 0.09)
    """Metres, and the standard deviation of its logarithm, of homes: minima of building codes are 2.3 to 2.5
    m, and few ceilings are above 2.9 m. The deviations, also those below, hold what the scene's own heights
    are off by."""
    door: tuple[float, float] = (2.03, 0.07)
    """The same of door leaves: 1.98 (UK), 2.01 (DIN), 2.03 (US), 2.10 m."""
    eye: tuple[float, float] = (1.5, 0.2)
    """The same of a camera above the floor, as people hold it."""
    depth: tuple[float, float] = (1.08, 0.22)
    """The same of a metre as the network learned it; measured on held-out rooms."""


LEVELLING = Levelling()
_WORDS = ("floor", "rug", "ceiling", "door")
_CALLED = ("ceiling", "door")


@dataclass(frozen=True)
class Surface:
    """n points of a scene's surface, as many of each piece as its area has.

    places, normals: (n, 3). answers: (n, 4) bool, which of `_WORDS` each answers to.
    """

    places: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    answers: Bool[np.ndarray, "n 4"]

    def called(self, *words: str) -> Bool[np.ndarray, " n"]:
        """What answers one of these words; nothing where too little does."""
        found = np.asarray(self.answers[:, [_WORDS.index(word) for word in words]].any(1))
        return found if len(found) and found.mean() >= LEVELLING.share else np.zeros_like(found)


@dataclass(frozen=True)
class Evidence:
    """One thing that tells the scale: metres per scene unit, and the deviation of its logarithm. height: of
    what is measured from the floor on, metres; 0 of what is not."""

    name: str
    metres: float
    error: float
    height: float = 0.0

    @staticmethod
    def of_height(name: str, usual: tuple[float, float], found: float) -> "Evidence":
        """What is usually so high, metres and deviation, was found at a height in scene units."""
        return Evidence(name, usual[0] / found, usual[1], usual[0])

    def misses(
        self, scales: Float[np.ndarray, "*s"], offsets: Float[np.ndarray, "*o"]
    ) -> Float[np.ndarray, "..."]:
        """By how many deviations, where scenes are exp(scales) metres a unit, and their floors too high by
        offsets (m)."""
        if not self.height:
            return np.asarray((scales - math.log(self.metres)) / self.error)
        metres = np.exp(scales) * self.height / self.metres + offsets
        return np.asarray(np.log(metres / self.height) / self.error)


@torch.no_grad()
def found_world(
    scene: Scene,
    *,
    up: Sequence[float] | None = None,
    north: Sequence[float] | None = None,
    origin: Sequence[float] | None = None,
) -> World:
    """Where a scene stands; what is given is not sought.

    Args:
        up, north: directions (3,) of the scene's axes. origin: the scene's point that is to lie at 0, on the
            floor; None: the floor under the first photo.

    Raises:
        InputError: the scene has no Gaussians, or a direction has no length, or north is up.
    """
    surface = surface_of(scene)
    found = found_directions(_sights(scene, surface), None if up is None else _unit("up", up))
    upward, (ahead, north_by) = found.up, _north(scene, found, north)
    axes = np.stack((np.cross(ahead, upward), -upward, ahead))  # rows east, down, north
    eyes = scene.viewmats.double().inverse()[:, :3, 3].numpy()
    height, floor_by = _floor(surface, upward, float((eyes @ upward).min()) if scene.photos else math.inf)
    place = eyes[0] - upward * (eyes[0] @ upward - height)
    if origin is not None:
        place, floor_by = _vector("origin", origin), "told"
    up_by, error = "edges" if found.edges > 0 else "surfaces", round(found.error, 2)
    if up is not None:
        up_by, error = "told", 0.0
    from scipy.spatial.transform import Rotation  # .08 s, which reading a scene has not to wait for

    w, x, y, z = Rotation.from_matrix(axes).as_quat(scalar_first=True).tolist()
    world = World((w, x, y, z), tuple(place.tolist()), up_by, error, floor_by, north_by)
    return replace(world, guess=guess_scale(evidence(scene, world, surface)))


NOT_SURE = "the photos do not clearly show which way is up; langflash level, or the window, guesses it"


def level_scene(scene: Scene) -> Scene:
    """The scene with where it stands in its record, where that is sure, and else with a warning; its tensors
    are the same."""
    try:
        world = found_world(scene)
    except InputError:  # nothing is there to stand on
        return scene
    if world.sure:
        return scene.with_record(world=world)
    return scene.with_record(warnings=(*scene.record.warnings, NOT_SURE))


def metres_of(scene: Scene) -> tuple[float | None, Guess | None]:
    """Metres per scene unit where they are known, and else the guess."""
    if scene.record.metric_scale:
        return scene.record.metric_scale, None
    return None, scene.record.world.guess if scene.record.world else None


def upright(scene: Scene) -> Scene:
    """The scene in its world: level, its floor at y = 0, north ahead; in metres where they are known.

    Raises:
        InputError: nobody has looked where it stands.
    """
    world = scene.record.world
    if world is None:
        raise InputError("this scene is not level yet; run langflash level first")
    metres = scene.record.metric_scale or 1.0
    unit = None if scene.record.network_unit is None else scene.record.network_unit / metres
    guess = world.guess
    if guess is not None:
        guess = Guess(guess.metres / metres, guess.low / metres, guess.high / metres, guess.by)
    stands = replace(world, turn=(1.0, 0.0, 0.0, 0.0), origin=(0.0, 0.0, 0.0), guess=guess)
    moved = transform_scene(scene, turn_of(world), np.array(world.origin), metres)
    known = 1.0 if scene.record.metric_scale else None
    return moved.with_record(world=stands, metric_scale=known, network_unit=unit)


def on_its_head(scene: Scene, up: Float[np.ndarray, "3"]) -> bool:
    """Whether what is called floor lies above what is called ceiling, up being a unit vector of the scene's
    axes; no, where it does not show both."""
    try:
        some = _surface_rows(scene)
    except InputError:  # nothing stands there
        return False
    answers, threshold = _relevance(some)
    floor, ceiling = answers[:, _WORDS.index("floor")], answers[:, _WORDS.index("ceiling")]
    # Either word may find both.
    below, above = (floor >= threshold) & (floor > ceiling), (ceiling >= threshold) & (ceiling > floor)
    if below.mean() < LEVELLING.share or above.mean() < LEVELLING.share:
        return False
    heights = some.gaussians.means.double().numpy() @ up
    return bool(np.median(heights[below]) > np.median(heights[above]))


def surface_of(scene: Scene) -> Surface:
    """`LEVELLING.samples` points of the surface; the same scene gives the same ones.

    Raises:
        InputError: there is no surface.
    """
    some = _surface_rows(scene)
    answers, threshold = _relevance(some)
    return Surface(some.gaussians.means.double().numpy(), normals_of(some.gaussians), answers >= threshold)


def _surface_rows(scene: Scene) -> Scene:
    """Those that show `LEVELLING.samples` points of the surface."""
    areas = covered_areas(scene.gaussians)
    areas = np.where(np.isfinite(scene.gaussians.means.numpy()).all(1), np.nan_to_num(areas), 0.0)
    total = float(areas.sum())
    if not total > 0:
        raise InputError("this scene holds no surface; make it again, or undo what deleted it")
    places = (np.arange(LEVELLING.samples) + 0.5) / LEVELLING.samples * total
    rows = np.searchsorted(np.cumsum(areas), places).clip(max=len(areas) - 1)
    return scene.rows(torch.from_numpy(rows))


def _relevance(some: Scene) -> tuple[np.ndarray, float]:
    """(n, 4) of `_WORDS`, and from which on it is an answer; none where the scene has no language, or no
    weights for it."""
    nothing = np.zeros((len(some.gaussians), len(_WORDS)), np.float32), 1.0
    if some.semantics.space == NO_LANGUAGE or not some.semantics.num_atoms:
        return nothing
    try:
        compiled = compile_query(some, language_space(some.semantics.space), list(_WORDS))
    except LangFlashError:  # surfaces and photos tell it without words
        return nothing
    return gaussian_relevance(some.semantics, compiled).T.numpy(), compiled.threshold


def _sights(scene: Scene, surface: Surface) -> Sights:
    """What photos and surfaces tell of directions."""
    edges, lengths = [np.zeros((0, 3))], [np.zeros(0)]
    for view, photo in enumerate(scene.photos):
        grey = decoded_photo(photo, "L")  # without those that are damaged there are surfaces still
        if grey is not None:
            found, long = edge_planes(grey, scene.camera(view, grey.shape[1], grey.shape[0]))
            edges.append(found)
            lengths.append(long)
    known, floor = surface.normals.any(1), surface.called("floor", "rug") & surface.normals.any(1)
    across = None
    if floor.any():
        across = np.linalg.eigh(surface.normals[floor].T @ surface.normals[floor])[1][:, 2]
    cameras = scene.viewmats[:, :3, :3].double().numpy()
    return Sights(np.concatenate(edges), np.concatenate(lengths), surface.normals[known], cameras, across)


def _north(scene: Scene, found: Directions, north: Sequence[float] | None) -> tuple[np.ndarray, str]:
    """The level direction that is to be north, and who says so."""
    if north is not None:
        told = _unit("north", north)
        level = told - found.up * (told @ found.up)
        if np.linalg.norm(level) < 0.1:
            raise InputError("north runs along up; give a direction along the floor")
        return level / np.linalg.norm(level), "told"
    ahead = scene.viewmats[0, 2, :3].double().numpy()
    sides = np.concatenate((found.axes[:, :2].T, -found.axes[:, :2].T))
    return sides[(sides @ ahead).argmax()], "walls"


def _floor(surface: Surface, up: np.ndarray, most: float) -> tuple[float, str]:
    """Height of the floor along up, below `most`, the lowest camera's; scene units, and who says so."""
    heights = surface.places @ up
    level = np.abs(surface.normals @ up) >= LEVELLING.level
    window = LEVELLING.window * float(np.subtract(*np.quantile(heights, (0.99, 0.01))))
    named = surface.called("floor") & level & (heights < most)
    if named.any():
        low = heights[named]
        below = low <= densest(low, window) - 4 * window
        # A ceiling is flat and large, too, and a word may find both.
        return densest(low[below] if below.mean() > LEVELLING.both else low, window), "floor"
    low = heights[level] if level.any() else heights
    bottom = float(np.quantile(heights, 0.01))
    if low.min() > bottom + 3 * window:  # what lies lowest is not level: the lowest that is
        bottom = float(low.min())
    return densest(low[low <= bottom + 3 * window], window), "lowest"


def densest(values: Float[np.ndarray, " n"], width: float) -> float:
    """Median of the window of that width that holds most values; the lowest such."""
    ordered = np.sort(values)
    ends = np.searchsorted(ordered, ordered + width, side="right")
    start = int((ends - np.arange(len(ordered))).argmax())
    return float(np.median(ordered[start : ends[start]]))


# How large


def evidence(scene: Scene, world: World, surface: Surface) -> list[Evidence]:
    """What tells how many metres a scene unit is."""
    stands = (surface.places - np.array(world.origin)) @ turn_of(world).T
    heights = -stands[:, 1]
    found = []
    if world.floor_by != "lowest":
        found += _of_ceiling(surface, heights, turn_of(world))
        found += _of_door(scene, surface, heights)
        eyes = scene.viewmats.double().inverse()[:, :3, 3].numpy() if scene.photos else np.zeros((0, 3))
        eye = -((eyes - np.array(world.origin)) @ turn_of(world).T)[:, 1]
        if len(eye) and np.median(eye) > 0:
            found.append(Evidence.of_height("camera height", LEVELLING.eye, float(np.median(eye))))
    posed = not torch.allclose(scene.viewmats[0], torch.eye(4), atol=1e-4)
    if scene.record.network_unit and not posed:  # else its unit is that of the poses
        found.append(Evidence("depth", LEVELLING.depth[0] * scene.record.network_unit, LEVELLING.depth[1]))
    return found


def guess_scale(found: Sequence[Evidence]) -> Guess | None:
    """The mean of the logarithm of metres per unit, and its deviation, by all evidence at once; None of
    nothing.

    What is taken for the floor may be a table top: then all heights fall short by the same. With m metres per
    unit, a height h of what is usually H, and the floor d too high, ln((m h + d) / H) has the evidence's
    deviation; or h is of something else, as what is called a door may be that of a cupboard.
    """
    if not found:
        return None
    usual = np.mean([math.log(each.metres) for each in found])
    scales = np.linspace(usual - LEVELLING.wide, usual + LEVELLING.wide, 601)  # logarithms
    offsets = np.linspace(0.0, LEVELLING.table, 49)  # m
    scores = np.full(len(offsets), math.log(LEVELLING.no_floor / (len(offsets) - 1)))
    scores[0] = math.log(1 - LEVELLING.no_floor)
    scores = np.tile(scores, (len(scales), 1))
    for each in found:
        told = -0.5 * each.misses(scales[:, None], offsets) ** 2
        scores += np.logaddexp(told, math.log(LEVELLING.another)) if each.name in _CALLED else told
    chances = np.exp(scores - scores.max())
    chances /= chances.sum()
    mean = float(chances.sum(1) @ scales)
    error = math.sqrt(float(chances.sum(1) @ (scales - mean) ** 2))
    floor = float(chances[:, 0].sum()) >= 0.5
    told = [each for each in found if floor or not each.height]
    here = np.array(mean), np.array(0.0)
    agree = [each for each in told if abs(each.misses(*here)) <= LEVELLING.contradicted]
    names = tuple(each.name for each in sorted(agree or found, key=lambda each: each.error))
    low, middle, high = (math.exp(mean + step) for step in (-error, 0.0, error))
    return Guess(middle, low, high, names)


def _of_ceiling(surface: Surface, heights: np.ndarray, turn: np.ndarray) -> list[Evidence]:
    """The height of what answers "ceiling", is level, and has little above it."""
    level = np.abs(surface.normals @ turn[1]) >= LEVELLING.level
    named = surface.called("ceiling") & level & (heights > 0)
    if named.mean() < LEVELLING.share / 2:
        return []
    top = float(np.quantile(heights, 0.995))
    high = densest(heights[named], LEVELLING.window * top)
    return [Evidence.of_height("ceiling", LEVELLING.ceiling, high)] if high > 0.85 * top else []


def _of_door(scene: Scene, surface: Surface, heights: np.ndarray) -> list[Evidence]:
    """The height of what answers "door", where it stands on the floor and ends inside a photo."""
    named = surface.called("door")
    if not named.any():
        return []
    low, high = np.quantile(heights[named], (0.03, 0.97))
    top = surface.places[named][heights[named] >= 0.97 * high]
    stands = high > 0 and low <= 0.12 * high
    if not (stands and any(_inside(scene, view, top) for view in range(scene.num_views))):
        return []
    return [Evidence.of_height("door", LEVELLING.door, float(high))]


def _inside(scene: Scene, view: int, places: np.ndarray) -> bool:
    """Whether a photo has most of these places, and none near its border."""
    shares, depths = picture_shares(scene.camera(view), places)
    well = ((shares > LEVELLING.edge) & (shares < 1 - LEVELLING.edge)).all(1)
    return bool(((depths > 0) & well).mean() > 0.9)


def picture_shares(
    camera: Camera, places: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"]]:
    """Where places are in a picture, of its width and height, and their depths."""
    size = camera.width, camera.height
    seen = see(places, camera.viewmat.double().numpy(), camera.K.double().numpy(), size)
    return np.stack((seen.x, seen.y), 1) / size, seen.z


def _unit(name: str, values: Sequence[float]) -> np.ndarray:
    vector = _vector(name, values)
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        raise InputError(f"{name} has no length; give a direction such as 0,-1,0")
    return vector / length


def _vector(name: str, values: Sequence[float]) -> np.ndarray:
    vector = np.array(values, float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{name} takes three finite numbers; received {tuple(values)}")
    return vector


# Told lengths


def apply_measurement(scene: Scene, a: Sequence[float], b: Sequence[float], metres: float) -> Scene:
    """The scene in the unit in which two of its points are so many metres apart.

    Raises:
        InputError: it is the same point.
    """
    length = float(np.linalg.norm(_vector("A", a) - _vector("B", b)))
    if length < 1e-6:
        raise InputError("both ends of the length are one point; name two ends of what you know")
    return scene.with_record(metric_scale=metres / length)


def measured_by(scene: Scene, name: str, metres: float) -> Scene:
    """The scene in the unit in which its "ceiling" or "door" is so many metres high.

    Raises:
        InputError: the scene's world is not known, or it shows no such thing from floor to top.
    """
    world = scene.record.world
    if world is None:
        raise InputError("this scene is not level yet; run langflash level first")
    usual = {"ceiling": LEVELLING.ceiling, "door": LEVELLING.door}[name][0]
    found = [each for each in evidence(scene, world, surface_of(scene)) if each.name == name]
    if not found:
        raise InputError(
            f"no photo shows a {name} from the floor to its top; give a length A B METRES instead"
        )
    return scene.with_record(metric_scale=found[0].metres * metres / usual)


def seen_at(scene: Scene, view: int, u: float, v: float) -> tuple[float, float, float]:
    """The scene's point that a pixel of a photo shows, at the size that the scene has views at.

    Raises:
        InputError: there is no such photo or pixel, or it shows nothing.
    """
    width, height = scene.view_size
    if not 0 <= view < scene.num_views or not (0 <= u <= width and 0 <= v <= height):
        photos = f"photos 1 to {scene.num_views} of {width} x {height} pixels"
        raise InputError(f"{view + 1}:{u:g},{v:g} is no pixel of a photo; this scene has {photos}")
    whole = scene.camera(view)
    K = whole.K.clone()
    K[0, 2], K[1, 2] = K[0, 2] - u + 0.5, K[1, 2] - v + 0.5  # its middle is the pixel of a picture of one
    frame = render(scene, Camera(whole.viewmat, K, 1, 1), weight_maps=False)
    if float(frame.alphas[0, 0]) < 0.5:
        raise InputError(f"nothing is seen at pixel {u:g},{v:g} of photo {view + 1}; name another")
    x, y, z = world_points(frame.depths, Camera(whole.viewmat, K, 1, 1))[0, 0].tolist()
    return x, y, z
