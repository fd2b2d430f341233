"""`lab eval level`: how scenes stand, how large they are, what inventory, plan and clicks get right.

Rooms are drawn from their seeds, so up, metres, walls and every thing are known. A scene is made of a room's
photos by the code as it is (or read from where an earlier run kept it). A Gaussian is of the true thing that
its own photo shows at its place; a thing of the inventory is right where it and a true thing of that name
share `OVERLAP` of the pixels that either fills in the photos (intersection over union). Of a wall it counts
how far it is from the true one, as a share of how far that is from the first camera.

Sizes: N Gaussians, I true instances, V photos.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from scipy.ndimage import distance_transform_edt

from langflash_core.base.files import make_folder
from langflash_core.base.records import World
from langflash_core.base.running import Progress
from langflash_core.geometry.rotations import turn_of
from langflash_core.inventory import Inventory, Thing, inventory
from langflash_core.inventory.pieces import OPENINGS, STRUCTURE
from langflash_core.inventory.plan import Plan, floor_plan
from langflash_core.lab.evaluation.bench import files_of
from langflash_core.lab.evaluation.clicks import judge_clicks
from langflash_core.lab.evaluation.tables import Measure, Table, by_measure, rounded
from langflash_core.lab.photos import LabelledPhoto
from langflash_core.lab.rooms import (
    HELD_OUT_LIBRARIES,
    Pack,
    RoomRenderer,
    RoomViews,
    StagedRoom,
    staged_room,
)
from langflash_core.lab.training.cache import SIZES
from langflash_core.lab.training.measures import nan_mean
from langflash_core.language.vocabulary import groups_of
from langflash_core.level import found_world
from langflash_core.pipeline import reconstruct
from langflash_core.reconstruction.networks import Networks
from langflash_core.scene.file import load, save
from langflash_core.types import Scene

TIMES = 2
"""So many times the network's grid photos are drawn at."""
OVERLAP = 0.3
SEEN, SHOWN = 0.005, 0.001
"""Shares of a photo: of a true thing that is to be found, and of one that counts where it is."""
WALL_SEEN = 0.03
"""Of a photo: of a true wall that is to be found."""
DEGREES, LENGTHS, WALLS = 1.0, 0.10, 0.05
"""Up to these errors, up, lengths and walls count as right."""
_SAME_WAY, _AT_WALL, _NEAREST = 0.96, 0.5, 0.5


@dataclass(frozen=True)
class Judged:
    """Numbers of one room; NaN where there is nothing to measure. walls: errors of those found."""

    seed: int
    numbers: dict[str, float]
    walls: tuple[float, ...] = ()
    sizes: tuple[float, ...] = ()


def run_level(
    pack: Pack,
    seeds: Iterable[int],
    *,
    photos: int = 2,
    keep: Path | None = None,
    things: bool = True,
    progress: Progress = lambda stage, fraction: None,
) -> dict:
    """Judge rooms.

    Args:
        photos: V of each room. keep: where scenes are kept as SEED.langflash, and read again. things: also
            inventory and plan.

    Returns:
        Plain JSON: `rooms` (a row each) and `summary`.
    """
    chosen, judged, networks = list(seeds), [], Networks()
    with RoomRenderer(pack) as drawer:
        for number, seed in enumerate(chosen):
            progress(f"room {seed}", number / max(1, len(chosen)))
            try:
                staged = drawn_room(pack, drawer, seed, photos)
            except ValueError:  # no usable photos in any room of this seed
                continue
            scene = kept_scene(staged, seed, keep, networks)
            judged.append(judge(seed, scene, staged, things=things))
    return {
        "rooms": [{"seed": each.seed, **rounded(each.numbers)} for each in judged],
        "summary": summary(judged),
    }


def drawn_room(pack: Pack, drawer: RoomRenderer, seed: int, photos: int) -> StagedRoom:
    """The held-out room of a seed, its photos `TIMES` as large as the network's grid.

    Raises:
        ValueError: no usable photos were found.
    """
    width, height = (TIMES * side for side in SIZES[seed // 7 % len(SIZES)])
    return staged_room(
        seed, pack, drawer, num_views=photos, size=(height, width), libraries=HELD_OUT_LIBRARIES
    )


def kept_scene(staged: StagedRoom, seed: int, keep: Path | None, networks: Networks | None = None) -> Scene:
    """The scene of a room's photos, made now or by an earlier run."""
    path = None if keep is None else keep / f"{seed}.langflash"
    if path is not None and path.is_file():
        return load(path)
    photos = [LabelledPhoto(f"{seed}_{view}", image) for view, image in enumerate(staged.views.images)]
    with files_of(photos) as files:
        K = staged.views.Ks[0]
        lens = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
        scene = reconstruct(files, intrinsics=lens, networks=networks)
    if path is not None:
        make_folder(path.parent)
        save(scene, path)
    return scene


@torch.no_grad()
def judge(seed: int, scene: Scene, staged: StagedRoom, *, things: bool = True) -> Judged:
    """One room. things: also what is in it."""
    world = found_world(scene)
    unit = true_unit(scene, staged)
    numbers = judge_world(scene, world, unit, staged)
    if not things:
        return Judged(seed, numbers)
    found = inventory(scene.with_record(world=world, metric_scale=unit))
    views = replace(staged.views, instances=seen_through(staged.views))
    known = replace(staged, views=views)
    more, sizes = judge_things(found, known)
    clicked, own = true_things(known, SEEN), true_instances(scene, known)
    more |= judge_clicks(scene, views.instances.astype(int), clicked, own)
    walls, seen = judge_walls(found, floor_plan(found), staged)
    return Judged(seed, numbers | more | seen, walls, sizes)


def true_unit(scene: Scene, staged: StagedRoom) -> float:
    """Metres per scene unit: the median of true depth over the scene's own, in the first photo."""
    depths = staged.views.depths[0].astype(float)
    own = scene.gaussians.means[first_photo(scene)].double().numpy()
    rows, columns = _pixels(scene, 0, own, depths.shape)
    true = depths[rows, columns]
    known = (true > 0) & (own[:, 2] > 0)
    return float(np.median(true[known] / own[known, 2]))


def first_photo(scene: Scene) -> torch.Tensor:
    """(N,) bool, of the first photo; all, where nobody knows."""
    return (
        torch.ones(len(scene.gaussians), dtype=torch.bool) if scene.view_ids is None else scene.view_ids == 0
    )


def _pixels(
    scene: Scene, view: int, points: np.ndarray, size: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns where a photo of that size (height, width) shows points of the scene."""
    height, width = size[0], size[1]
    camera = scene.camera(view, width, height)
    viewmat, K = camera.viewmat.double().numpy(), camera.K.double().numpy()
    pos_c = points @ viewmat[:3, :3].T + viewmat[:3, 3]
    with np.errstate(all="ignore"):
        columns, rows = np.nan_to_num((pos_c / pos_c[:, 2:]) @ K[:2].T).T
    return rows.astype(int).clip(0, height - 1), columns.astype(int).clip(0, width - 1)


def judge_world(scene: Scene, world: World, unit: float, staged: StagedRoom) -> dict[str, float]:
    """Up, the floor and the guessed scale."""
    up = staged.home[:3, :3] @ np.array([0.0, 1.0, 0.0])
    error = math.degrees(math.acos(min(1.0, float(-turn_of(world)[1] @ up))))
    floor = np.linalg.inv(staged.home) @ np.append(unit * np.array(world.origin), 1.0)
    guess = world.guess
    off = math.nan if guess is None else abs(math.log(guess.metres / unit))
    seen = guess is not None and bool({"door", "ceiling"} & set(guess.by))
    within = math.nan if math.isnan(off) else float(off <= math.log1p(LENGTHS))
    return {
        "up_error": error,
        "up_right": float(error < DEGREES),
        "up_said": world.up_error,
        "camera_error": math.degrees(math.acos(min(1.0, float(-np.array([0.0, 1, 0]) @ up)))),
        "floor_error": abs(float(floor[1])) if world.floor_by == "floor" else math.nan,
        "length_error": off,
        "length_right": within,
        "length_right_seen": within if seen else math.nan,
        "length_within_said": math.nan if guess is None else float(guess.low <= unit <= guess.high),
    }


# Things


def judge_things(found: Inventory, staged: StagedRoom) -> tuple[dict[str, float], tuple[float, ...]]:
    """Precision and recall of things, what counts are off by per kind; and errors of sizes, as shares."""
    views = staged.views
    true, wanted = true_things(staged, SHOWN), set(true_things(staged, SEEN))
    pairs = _pairs(found, staged, true)
    right = {thing.id: i for thing, i in pairs if views.groups[i] == thing.kind}
    true_of = {thing.id: i for thing, i in pairs if views.groups[i] in groups_of(thing.kind)}
    counts, truth = Counter(thing.kind for thing in found.things), Counter(views.groups[i] for i in wanted)
    kinds = set(counts) | set(truth)
    number = len(found.things)
    numbers = {
        "precision": len(right) / number if number else math.nan,
        "recall": len(set(right.values()) & wanted) / len(wanted) if wanted else math.nan,
        "precision_true_name": len(true_of) / number if number else math.nan,
        "recall_true_name": len(set(true_of.values()) & wanted) / len(wanted) if wanted else math.nan,
        "precision_any_name": len(pairs) / number if number else math.nan,
        "recall_any_name": len({i for _, i in pairs} & wanted) / len(wanted) if wanted else math.nan,
        "count_error": nan_mean(float(abs(counts[kind] - truth[kind])) for kind in kinds),
    }
    boxes = {tuple(views.names[i]): i for i in true}
    sizes = [
        error
        for thing, i in pairs
        if not thing.cut and views.groups[i] == thing.kind
        for error in [_size_error(thing, i, staged, boxes)]
        if not math.isnan(error)
    ]
    return numbers, tuple(sizes)


def seen_through(views: RoomViews) -> np.ndarray:
    """(V, H, W) instances, where what is seen through a window or door is of it: the nearest in the photo.

    Rooms have nothing outside; who looks at a photo calls that part of it a window all the same.
    """
    openings = [i for i, group in enumerate(views.groups) if group in OPENINGS]
    filled = []
    for ids in views.instances:
        of_openings = np.isin(ids, openings)
        if of_openings.any():
            nearest = distance_transform_edt(~of_openings, return_distances=False, return_indices=True)
            ids = np.where(ids == 0, ids[tuple(np.asarray(nearest))], ids)
        filled.append(ids)
    return np.stack(filled)


def matched_things(found: Inventory, staged: StagedRoom, least: float = SHOWN) -> list[tuple[Thing, int]]:
    """Things with the true one that they share most with, where that is `OVERLAP` and more; of several that
    share most with the same one, the one that shares more. True ones fill `least` of a photo and more."""
    return _pairs(found, staged, true_things(staged, least))


def true_things(staged: StagedRoom, least: float) -> list[int]:
    """Instances that fill so much of a photo, without what rooms are made of."""
    views, count = staged.views, len(staged.views.groups)
    shown = np.stack([np.bincount(ids.ravel(), minlength=count) / ids.size for ids in views.instances]).max(0)
    return [i for i in range(1, count) if views.groups[i] not in STRUCTURE and shown[i] >= least]


def _pairs(found: Inventory, staged: StagedRoom, true: Sequence[int]) -> list[tuple[Thing, int]]:
    """Things with the true one that they share most with, where that is `OVERLAP` and more; of several that
    share most with the same one, the one that shares more."""
    shares = found.shares.sum(0)
    ids = true_instances(found.scene, staged)
    masses = {i: float(shares[ids == i].sum()) for i in true}
    best: dict[int, tuple[float, Thing]] = {}
    for thing in found.things:
        own = float(shares[thing.rows].sum())
        both = {i: float(shares[thing.rows & (ids == i)].sum()) for i in true}
        overlap = {i: both[i] / max(own + masses[i] - both[i], 1e-12) for i in true}
        instance = max(overlap, key=lambda i: overlap[i], default=None)
        if instance is None or overlap[instance] < max(OVERLAP, best.get(instance, (0.0, thing))[0]):
            continue
        best[instance] = (overlap[instance], thing)
    return [(thing, instance) for instance, (_, thing) in best.items()]


def true_instances(scene: Scene, staged: StagedRoom) -> np.ndarray:
    """(N,) the instance that its own photo shows where a Gaussian lies."""
    means = scene.gaussians.means.double().numpy()
    views = np.zeros(len(means), int) if scene.view_ids is None else scene.view_ids.numpy()
    found = np.zeros(len(means), int)
    for view in range(scene.num_views):
        own, ids = np.flatnonzero(views == view), staged.views.instances[view]
        found[own] = ids[_pixels(scene, view, means[own], ids.shape)]
    return found


def _size_error(thing: Thing, instance: int, staged: StagedRoom, boxes: dict) -> float:
    """Mean share by which width and height are off; NaN of several of one name, whose boxes are not known
    apart. Depth is left out: photos see the front of most things."""
    names = tuple(staged.views.names[instance])
    same = [each for each in staged.room.instances if tuple(each.names) == names]
    if len(same) != 1 or boxes.get(names) != instance:
        return math.nan
    box = same[0].high - same[0].low
    turn = same[0].model[:3, :3] / np.linalg.norm(same[0].model[:3, :3], axis=0)
    sides = np.abs(turn.T @ box) if max(abs(turn[0, 0]), abs(turn[0, 2])) > 0.99 else None
    if sides is None:  # turned freely: its box in the room is no measure
        return math.nan
    true = max(sides[0], sides[2]), sides[1]
    return nan_mean(abs(a - b) / b for a, b in zip((thing.size[0], thing.size[2]), true, strict=True))


# Walls


def judge_walls(
    found: Inventory, plan: Plan, staged: StagedRoom
) -> tuple[tuple[float, ...], dict[str, float]]:
    """Errors of the plan's walls that are true ones; how many true ones are found, and how many are none."""
    to_room = _to_room(found, staged)
    walls, eye = staged.room.shell.walls, np.linalg.inv(staged.home)[[0, 2], 3]
    errors, hits, wrong, claimed = [], set(), 0, 0
    for wall in plan.walls:
        start, end = to_room(wall.start), to_room(wall.end)
        along, middle = (end - start) / np.linalg.norm(end - start), (start + end) / 2
        near = [
            (abs(float((middle - true.start) @ true.inward)), number)
            for number, true in enumerate(walls)
            if abs(along @ true.direction) > _SAME_WAY
            and -_AT_WALL < (middle - true.start) @ true.direction < true.length + _AT_WALL
        ]
        off, number = min(near, default=(math.inf, -1))
        if off > _AT_WALL:
            wrong, claimed = wrong + 1, claimed + (not wall.doubt)
            continue
        hits.add(number)
        errors.append(off / max(abs(float((eye - walls[number].start) @ walls[number].inward)), _NEAREST))
    seen = _walls_seen(staged)
    recall = len(seen & hits) / len(seen) if seen else math.nan
    return tuple(errors), {
        "wall_recall": recall,
        "walls_wrong": float(wrong),
        "walls_claimed": float(claimed),
    }


def _to_room(found: Inventory, staged: StagedRoom) -> Callable[[tuple[float, float]], np.ndarray]:
    """From places of the plan to x and z of the room, metres."""
    turn, origin = turn_of(found.world).T, np.array(found.world.origin) * found.scale
    back = np.linalg.inv(staged.home)

    def at(place: tuple[float, float]) -> np.ndarray:
        point = turn @ np.array([place[0], 0.0, place[1]]) + origin
        return (back @ np.append(point, 1.0))[[0, 2]]

    return at


def _walls_seen(staged: StagedRoom) -> set[int]:
    """True walls that fill `WALL_SEEN` of some photo."""
    views, walls = staged.views, staged.room.shell.walls
    own = [i for i, group in enumerate(views.groups) if group == "wall"]
    seen: set[int] = set()
    for ids, depths, K, viewmat in zip(views.instances, views.depths, views.Ks, views.viewmats, strict=True):
        rows, columns = np.isin(ids, own).nonzero()
        rays = np.stack((columns + 0.5, rows + 0.5, np.ones(len(rows)))) * depths[rows, columns]
        points = np.linalg.inv(K.astype(float)) @ rays
        world = np.linalg.inv(viewmat.astype(float)) @ np.concatenate((points, np.ones((1, len(rows)))))
        places = (np.linalg.inv(staged.home) @ world)[[0, 2]].T
        offsets = np.stack([np.abs((places - wall.start) @ wall.inward) for wall in walls])
        shares = np.bincount(offsets.argmin(0), minlength=len(walls)) / ids.size
        seen |= {int(number) for number in np.flatnonzero(shares > WALL_SEEN)}
    return seen


def summary(judged: Sequence[Judged]) -> dict[str, float | None]:
    """Means over rooms; medians where the name says so."""
    names = list(dict.fromkeys(name for each in judged for name in each.numbers))
    found = {name: nan_mean(each.numbers.get(name, math.nan) for each in judged) for name in names}
    for name in ("up_error", "floor_error", "length_error"):
        values = [each.numbers[name] for each in judged if not math.isnan(each.numbers[name])]
        found[f"{name}_median"] = float(np.median(values)) if values else math.nan
    seen = [each for each in judged if not math.isnan(each.numbers["length_right_seen"])]
    walls, sizes = (
        [value for each in judged for value in getattr(each, name)] for name in ("walls", "sizes")
    )
    found |= {
        "rooms": float(len(judged)),
        "rooms_with_door_or_ceiling": float(len(seen)),
        "walls_found": float(len(walls)),
        "wall_error_median": float(np.median(walls)) if walls else math.nan,
        "wall_right": nan_mean(float(error < WALLS) for error in walls),
        "sizes_measured": float(len(sizes)),
        "size_error_median": float(np.median(sizes)) if sizes else math.nan,
    }
    return rounded(found)


MEASURES = (
    ("Rooms", "rooms"),
    ("Up, median error (degrees)", "up_error_median"),
    ("... the first camera's own", "camera_error"),
    ("Up within 1 degree", "up_right"),
    ("Floor where one is seen, median error (m)", "floor_error_median"),
    ("Guessed lengths, median error (log)", "length_error_median"),
    ("Guessed lengths within 10 %", "length_right"),
    ("Rooms with a door or ceiling that tells", "rooms_with_door_or_ceiling"),
    ("... lengths within 10 %", "length_right_seen"),
    ("True length within the guess's bounds", "length_within_said"),
    ("Things: precision", "precision"),
    ("Things: recall", "recall"),
    ("Things by a name that is true of them (a desk is a table): precision", "precision_true_name"),
    ("Things by a name that is true of them: recall", "recall_true_name"),
    ("Things, whatever they are called: precision", "precision_any_name"),
    ("Things, whatever they are called: recall", "recall_any_name"),
    ("Count error per kind", "count_error"),
    ("Sizes measured", "sizes_measured"),
    ("Width and height, median error", "size_error_median"),
    ("One click on a thing: intersection over union", "click_iou"),
    ("... over .5, share of clicks", "click_right"),
    ("... the best level: intersection over union", "click_best_iou"),
    ("... the best level over .5, share of clicks", "click_best_right"),
    ("Walls found", "walls_found"),
    ("Walls, median error of their distance", "wall_error_median"),
    ("Walls within 5 % of their distance", "wall_right"),
    ("Walls that photos see: recall", "wall_recall"),
    ("Walls that are none, a room", "walls_wrong"),
    ("... and not drawn as doubted", "walls_claimed"),
)  # fmt: skip


def tables(result: dict) -> list[Table]:
    """The summary."""
    measures = [Measure(title, key, "g") for title, key in MEASURES]
    return [by_measure("", "measure", {"value": result["summary"]}, measures)]
