"""Where the photos were taken, for whoever keeps to what they saw; turns that know it and which way is up."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from jaxtyping import Bool

from langflash_core.base.records import World
from langflash_core.geometry import poses, rotations
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene.changes import Moved
from langflash_core.scene.edits import Marks
from langflash_core.scene.surroundings import Surroundings

from ..state import State
from .state import SceneInfo

RIGHTING = math.radians(15.0)
"""Of turning, within which most of a photo's roll is gone."""
ASLANT = math.radians(2.0)  # of a photo's roll, which one sees
AT_PHOTO = 0.005  # of the distance to what a photo looks at: so near to its place one stands there
ENOUGH, LEAST = 0.95, 0.8
"""Of what a picture shows at the nearest photo's place: a move that leads to less than enough slows down, and
stops at the least."""
UNHURRIED = 0.25  # pace of keys and wheel where a drag stops: each press, each notch is meant
TURN_PART = math.radians(3.0)  # of a move that is judged at once
MOST_PARTS = 40  # of one frame's move: some 40 ms
PUSHES = 3  # out of surfaces, one after the other, as in a corner
TOUCHING = 1e-3  # of the way that is kept clear, by which they may err
FADING = 30.0  # degrees aside from which the picture fades: `FULL` of langflash_core/scene/trust.py


def keeps_near(state: State, pose: Pose | None = None) -> bool:
    """Whether the person wants to keep to what the photos saw, where that is known; parallel rays show all.
    pose: of the picture, None: as on show."""
    flat = (pose or state.scene.pose).span is not None
    return state.preferences.near_photos and not flat and photos_known(state)


def photos_known(state: State) -> bool:
    """Whether photos made all there is: not where a file does not say, nor with what a merge brought, which
    is behind all else. What fills a hole in all layers nobody saw, and it is where photos look."""
    info, marks = state.scene.info, state.editing.marks
    if info is None or info.scene.view_ids is None:
        return False
    count = len(info.scene.view_ids) if marks is None else marks.there[0]
    if count == 0:
        return False
    sure, layered = info.scene.confidences, info.scene.layered
    fills = layered and sure is not None and float(sure[count - 1]) == 0
    return fills or int(info.scene.view_ids[count - 1]) >= 0


def fills_gaps(state: State) -> bool:
    """Whether the picture shows what is around its gaps. Surfaces made of photos have cracks; splats from
    elsewhere may be a thing on its own, as is what is left once most is deleted or hidden, and a thing's
    outline is no gap."""
    info, marks = state.scene.info, state.editing.marks
    if not state.preferences.fill_gaps or info is None or info.scene.view_ids is None:
        return False
    return marks is None or 2 * len(marks.deleted | marks.hidden) <= marks.deleted.count


def places_to_keep_to(state: State) -> tuple[Vector, ...]:
    """Of the photos that the scene was made of; none where nothing keeps to them."""
    info = state.scene.info
    return () if info is None or not keeps_near(state) else tuple(view.centre for view in info.views)


def degrees_from_photos(state: State) -> float:
    """Of what is looked at, between here and the nearest place to keep to; 0 where there is none."""
    places = places_to_keep_to(state)
    return poses.degrees_aside(state.scene.pose, places) if places else 0.0


def flown_past(state: State) -> bool:
    """Whether nearly all of the scene lies behind who looks, as after a flight through it."""
    info, pose = state.scene.info, state.scene.pose
    if info is None or info.extent is None or pose.span is not None:
        return False
    forward = pose.axes[:, 2]
    farthest = np.where(forward > 0, info.extent[1], info.extent[0])  # corner of the box
    return float(forward @ (farthest - np.array(pose.centre))) < 0


def surroundings(state: State) -> Surroundings | None:
    """What holds a camera back, as edits left it; None where nothing does. What was moved stands nowhere."""
    info, marks = state.scene.info, state.editing.marks
    if info is None or not keeps_near(state):
        return None
    around = info.memory.surroundings()
    if around is None or marks is None:
        return around
    about = (marks.deleted, marks.hidden, marks.there, marks.changes)
    return info.memory.answered("surroundings left", about, lambda: around.of(_standing(marks)))


def _standing(marks: Marks) -> Bool[np.ndarray, " N"]:
    there = marks.visible.rows()
    for change in marks.changes:
        if isinstance(change, Moved):
            there &= ~change.rows.rows()
    return there


def at_photo(state: State) -> bool:
    """Whether one stands where a photo was taken."""
    pose, info = state.scene.pose, state.scene.info
    if info is None or pose.span is not None:
        return False
    return any(math.dist(view.centre, pose.centre) <= AT_PHOTO * view.reach for view in info.views)


def first_stand(info: SceneInfo, world: World | None) -> Pose:
    """Where one stands first: as the first photo saw it, upright where that was held aslant and it is known
    how the scene stands."""
    start = info.views[0] if info.views else poses.START
    if world is None:
        return start
    turn = rotations.matrix(world.turn)
    if not info.views:
        return poses.facing(start, Vector(*turn[2].tolist()), -turn[1])
    return poses.make_upright(start, -turn[1]) if abs(poses.roll(start, -turn[1])) > ASLANT else start


def middle_of_near(state: State) -> Vector | None:
    """Ahead, as far away as the middle of what is near in the picture; None where nobody knows."""
    pose, around = state.scene.pose, surroundings(state)
    depth = None if around is None else around.middle(pose)
    return None if depth is None else Vector(*(np.array(pose.centre) + depth * pose.axes[:, 2]).tolist())


# Moves, each with the share of it that was done


def orbited(
    state: State, pose: Pose, yaw: float, pitch: float, pivot: Vector | None = None, least: float = 0.0
) -> tuple[Pose, float]:
    """The pose turned around a pivot, radians; None: its own. A photo that was held aslant comes upright on
    the way, in a scene of which it is known how it stands. least: as in `held`."""
    about = None if pivot is None else np.array(pivot)

    def move(pose: Pose, share: float) -> Pose:
        return poses.around(pose, _turned(state, pose, share * yaw, share * pitch), about)

    return held(state, pose, move, least)


def looked(state: State, pose: Pose, yaw: float, pitch: float, least: float = 0.0) -> tuple[Pose, float]:
    """The pose turned on the spot, radians; upright on the way, as in `orbited`."""
    return held(state, pose, lambda at, share: _turned(state, at, share * yaw, share * pitch), least)


def flown(
    state: State, pose: Pose, right: float, down: float, forward: float, least: float = 0.0
) -> tuple[Pose, float]:
    """The pose moved along its own axes, scene units."""
    move = lambda at, share: poses.fly(at, share * right, share * down, share * forward)  # noqa: E731
    return held(state, pose, move, least)


def zoomed(state: State, pose: Pose, factor: float) -> Pose:
    """The pose at so many times the distance from its pivot; a turn of the wheel is no slip."""
    return held(state, pose, lambda at, share: poses.zoom(at, factor**share), UNHURRIED)[0]


def held(
    state: State, pose: Pose, move: Callable[[Pose, float], Pose], least: float = 0.0
) -> tuple[Pose, float]:
    """A move as far as it leads into no surface, and slower and to a stop where less and less of the picture
    is known; free on the way back, and where nothing is kept to. Along a surface it slides.

    Args:
        move: the pose after a share of the whole move. least: pace at which it goes on without a stop.

    Returns:
        The pose, and the share that was done.
    """
    around, whole = surroundings(state), move(pose, 1.0)
    if around is None:
        return whole, 1.0
    parts, done = _parts(pose, whole, around), 0.0
    known, usual = around.known(pose), _usual(state, pose, around)
    for _ in range(parts):
        after = move(pose, 1 / parts)
        there = around.known(after)
        share = 1.0 if there >= known else _pace(there / max(usual(after), 1e-9), least)
        moved = _beside(around, pose, after if share == 1 else move(pose, share / parts))
        if share == 0 or moved is None:
            break
        known = there if moved is after else around.known(moved)
        pose, done = moved, done + share / parts
    return pose, done


def _parts(pose: Pose, whole: Pose, around: Surroundings) -> int:
    """In how many parts a move is judged: a quick drag ends where a slow one does, and passes no wall."""
    way = math.dist(pose.centre, whole.centre) / (around.clear / 2)
    cosine = (float(np.trace(pose.axes.T @ whole.axes)) - 1) / 2
    turn = math.acos(min(max(cosine, -1.0), 1.0)) / TURN_PART
    return min(max(1, math.ceil(way), math.ceil(turn)), MOST_PARTS)


def _usual(state: State, lens: Pose, around: Surroundings) -> Callable[[Pose], float]:
    """Says what share of a picture, through a pose's lens, is known at the photo's place that is nearest to
    another pose: beside an upright photo a wide window shows what no photo saw."""
    views = [] if state.scene.info is None else list(state.scene.info.views)
    known = cache(lambda view: around.known(poses.with_lens(view, lens)))

    def usual(pose: Pose) -> float:
        if not views:
            return 1.0
        return known(min(views, key=lambda view: math.dist(view.centre, pose.centre)))

    return usual


def _pace(known: float, least: float) -> float:
    """Share of a move after which less is known than before: so much of what is at a photo's place."""
    return min(max((known - LEAST) / (ENOUGH - LEAST), least), 1.0)


def _beside(around: Surroundings, before: Pose, after: Pose) -> Pose | None:
    """The pose pushed clear of surfaces, so that it slides along them; None where that does not do. Who is
    too near already may go away, and no nearer."""
    least = min(around.clear, around.nearest(np.array(before.centre))[0])
    end = np.array(after.centre)
    for pushed in range(PUSHES + 1):
        near, way = around.nearest(end)
        if near >= least - TOUCHING * around.clear:
            return replace(after, centre=Vector(*end.tolist())) if pushed else after
        end = end - (least / max(near, 1e-12) - 1) * way
    return None


def _turned(state: State, pose: Pose, yaw: float, pitch: float) -> Pose:
    """On the spot; upright on the way where it is known what is."""
    pose = poses.look(pose, yaw, pitch, state.up)
    if state.world is None:
        return pose
    return poses.make_upright(pose, state.up, 1 - math.exp(-math.hypot(yaw, pitch) / RIGHTING))
