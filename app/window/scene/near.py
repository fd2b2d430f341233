"""Where the photos were taken, for whoever keeps to what they saw."""

from ..poses import Vector
from ..state import State


def places_to_keep_to(state: State) -> tuple[Vector, ...]:
    """Of the photos that the scene was made of; none where nobody knows them, or wants to keep to them."""
    info = state.info
    if info is None or info.scene.view_ids is None or not state.preferences.near_photos:
        return ()
    return tuple(view.centre for view in info.views)
