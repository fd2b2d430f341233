"""Where the photos were taken, for whoever keeps to what they saw."""

from .. import poses
from ..poses import Vector
from ..state import State

FADING = 30.0  # degrees aside from which the picture fades: `FULL` of langflash_core/scene/trust.py


def keeps_near(state: State) -> bool:
    """Whether the person wants to keep to what the photos saw; parallel rays show all there is."""
    return state.preferences.near_photos and state.pose.span is None


def places_to_keep_to(state: State) -> tuple[Vector, ...]:
    """Of the photos that the scene was made of; none where nobody knows them, or wants to keep to them,
    or the picture is a plan."""
    info = state.info
    if info is None or info.scene.view_ids is None or not keeps_near(state):
        return ()
    return tuple(view.centre for view in info.views)


def degrees_from_photos(state: State) -> float:
    """Of what is looked at, between here and the nearest place to keep to; 0 where there is none."""
    places = places_to_keep_to(state)
    return poses.degrees_aside(state.pose, places) if places else 0.0
