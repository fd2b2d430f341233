"""Where the photos were taken, for whoever keeps to what they saw."""

from langflash_core.geometry import poses
from langflash_core.geometry.poses import Pose, Vector

from ..state import State

FADING = 30.0  # degrees aside from which the picture fades: `FULL` of langflash_core/scene/trust.py


def keeps_near(state: State, pose: Pose | None = None) -> bool:
    """Whether the person wants to keep to what the photos saw, where that is known; parallel rays show all.
    pose: of the picture, None: as on show."""
    flat = (pose or state.scene.pose).span is not None
    return state.preferences.near_photos and not flat and photos_known(state)


def photos_known(state: State) -> bool:
    """Whether photos made all there is: not where a file does not say, nor with what a merge brought, which
    is behind all else."""
    info, marks = state.scene.info, state.editing.marks
    if info is None or info.scene.view_ids is None:
        return False
    count = len(info.scene.view_ids) if marks is None else marks.there[0]
    return count > 0 and int(info.scene.view_ids[count - 1]) >= 0


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
