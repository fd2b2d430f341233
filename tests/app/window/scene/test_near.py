"""Places of the photos that a window keeps to."""

import math
from dataclasses import replace

import pytest
import torch

from app.window import poses
from app.window.frame.status import figures
from app.window.scene.near import FADING, degrees_from_photos, places_to_keep_to
from app.window.state import State
from langflash_core.scene.trust import FULL
from tests.app.window.scenes import VIEWS, shown_scene


@pytest.fixture
def state() -> State:
    """A scene that is known to be of two photos, seen from 40 degrees to the left of the first."""
    shown = shown_scene()
    assert shown.info is not None
    scene = shown.info.scene
    known = replace(scene, view_ids=torch.zeros(len(scene.gaussians), dtype=torch.int64))
    aside = poses.orbit(VIEWS[0], math.radians(40), 0.0)
    if aside.centre.x > 0:
        aside = poses.orbit(VIEWS[0], math.radians(-40), 0.0)
    return replace(shown, info=replace(shown.info, scene=known), pose=aside)


def test_how_far_the_photos_are_is_told_where_the_picture_fades(state: State) -> None:
    assert FADING == FULL  # said twice, because the window starts before torch is there
    assert places_to_keep_to(state) == tuple(view.centre for view in VIEWS)
    assert degrees_from_photos(state) == pytest.approx(40)
    assert any("40 degrees aside" in text for text in figures(state))
    home = replace(state, pose=VIEWS[1])
    assert degrees_from_photos(home) < 1e-5 and not any("aside" in text for text in figures(home))


def test_nothing_is_kept_to_where_nobody_knows_the_photos_or_wants_to(state: State) -> None:
    free = replace(state, preferences=replace(state.preferences, near_photos=False))
    assert places_to_keep_to(free) == () and degrees_from_photos(free) == 0
    assert places_to_keep_to(shown_scene()) == () == places_to_keep_to(State())
