"""Where the photos were taken, for whoever keeps to what they saw; turns that know it and which way is up."""

import math

import numpy as np

from langflash_core.geometry import poses
from langflash_core.geometry.poses import Pose, Vector

from ..state import State

RIGHTING = math.radians(15.0)
"""Of turning, within which most of a photo's roll is gone."""
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


def orbited(state: State, pose: Pose, yaw: float, pitch: float) -> Pose:
    """The pose turned around its pivot, radians, no farther than photos know. A photo that was held aslant
    comes upright on the way, in a scene of which it is known how it stands."""
    return _righted(state, poses.orbit_near(pose, yaw, pitch, places_to_keep_to(state), state.up), yaw, pitch)


def looked(state: State, pose: Pose, yaw: float, pitch: float) -> Pose:
    """The pose turned on the spot, radians; upright on the way, as in `orbited`."""
    return _righted(state, poses.look(pose, yaw, pitch, state.up), yaw, pitch)


def _righted(state: State, pose: Pose, yaw: float, pitch: float) -> Pose:
    if state.world is None:
        return pose
    return poses.righted(pose, state.up, 1 - math.exp(-math.hypot(yaw, pitch) / RIGHTING))
