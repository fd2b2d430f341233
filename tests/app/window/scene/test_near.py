"""Places of the photos that a window keeps to."""

import math
from dataclasses import replace

import pytest
import torch

from app.window.frame.status import figures
from app.window.scene.near import FADING, degrees_from_photos, fills_gaps, places_to_keep_to
from app.window.state import State
from langflash_core.geometry import poses
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import History
from langflash_core.scene.mask import Mask
from langflash_core.scene.settings import TRUST
from tests.app.window.scenes import VIEWS, of_photos, shown_scene, with_info


@pytest.fixture
def state() -> State:
    """A scene that is known to be of two photos, seen from 40 degrees to the left of the first."""
    left, right = (poses.orbit(VIEWS[0], math.radians(turn), 0.0) for turn in (40, -40))
    return of_photos(shown_scene()).with_scene(pose=left if left.centre.x <= 0 else right)


def test_how_far_the_photos_are_is_told_where_the_picture_fades(state: State) -> None:
    assert TRUST.full == FADING  # said twice, because the window starts before torch is there
    assert places_to_keep_to(state) == tuple(view.centre for view in VIEWS)
    assert degrees_from_photos(state) == pytest.approx(40)
    assert any("40° away" in text for text in figures(state))
    home = state.with_scene(pose=VIEWS[1])
    assert degrees_from_photos(home) < 1e-5 and not any("away from" in text for text in figures(home))


def test_nothing_is_kept_to_where_nobody_knows_the_photos_or_wants_to(state: State) -> None:
    free = replace(state, preferences=replace(state.preferences, near_photos=False))
    assert places_to_keep_to(free) == () and degrees_from_photos(free) == 0
    assert places_to_keep_to(shown_scene()) == () == places_to_keep_to(State())


def test_what_fills_a_hole_of_all_layers_is_where_photos_look_and_a_merge_is_not(state: State) -> None:
    assert state.scene.info is not None
    scene = state.scene.info.scene
    ids = torch.zeros(len(scene.gaussians), dtype=torch.int64)
    ids[-5:] = -1
    for layered, sure, known in ((True, 0.0, True), (True, 1.0, False), (False, 0.0, False)):
        confidences = torch.full((len(ids),), sure)
        made = replace(scene, view_ids=ids, confidences=confidences).with_record(layered=layered)
        assert bool(places_to_keep_to(with_info(state, scene=made))) == known


def test_gaps_are_filled_in_scenes_of_photos_and_not_around_a_thing(state: State) -> None:
    assert fills_gaps(state) and not fills_gaps(shown_scene()) and not fills_gaps(State())
    assert not fills_gaps(replace(state, preferences=replace(state.preferences, fill_gaps=False)))
    assert state.scene.info is not None
    marks = first_marks(state.scene.info.scene)
    count = marks.deleted.count

    def filled(deleted: int, hidden: int) -> bool:
        gone = replace(marks, deleted=Mask.first(count, deleted), hidden=Mask.first(count, hidden))
        return fills_gaps(state.with_editing(history=History(gone)))

    assert filled(0, 0) and filled(count // 2, 0) and filled(count // 3, count // 2)
    assert not filled(count // 2 + 1, 0) and not filled(0, count - 1)
