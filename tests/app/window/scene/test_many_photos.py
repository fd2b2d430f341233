"""Scenes of hundreds of photos: small pictures of all, the one that is compared whole; progress photo by
photo."""

import io
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from app.window.commands import ShowPicture
from app.window.scene.commands import Progressed, SceneArrived
from app.window.scene.panels import tray
from app.window.scene.state import WHOLE_PHOTOS, Job, head_of, said
from app.window.scene.work import THUMBNAIL_SIDE, ShowPhotos, describe_scene
from app.window.state import State
from tests.app.window.scene.test_rooms import Desk
from tests.app.window.scenes import room


def jpeg(side: int) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.full((side, side, 3), 90, np.uint8)).save(stream, "JPEG")
    return stream.getvalue()


@pytest.mark.parametrize(("more", "side"), [(0, 768), (WHOLE_PHOTOS, THUMBNAIL_SIDE)])
def test_few_photos_are_shown_whole_many_small_and_a_damaged_one_by_its_number(more: int, side: int) -> None:
    photos = (jpeg(768), b"no picture", jpeg(30), *((jpeg(30),) * more))
    shown = [each for each in ShowPhotos(7, photos).run(lambda: False) if isinstance(each, ShowPicture)]
    assert [each.key for each in shown[:2]] == ["view 0", "view 2"] and len(shown) == 2 + more
    assert [each.rgb.shape for each in shown[:2]] == [(side, side, 3), (30, 30, 3)]


def test_no_frame_decodes_the_photos_of_a_scene_and_none_shows_those_of_another() -> None:
    """32 small photos took .16 processor seconds of the frame that showed their scene."""
    desk, decoded = Desk(), []
    desk.world.put_encoded = lambda *named: decoded.append(named)  # type: ignore[attr-defined]
    few = replace(room(torch.eye(3)), photos=(jpeg(30), jpeg(30)))
    other = replace(few, photos=(jpeg(40), jpeg(40)))
    for serial, (scene, goes) in enumerate(((few, []), (few, []), (other, ["view 0", "view 1"])), 1):
        desk.asked.clear()
        desk.perform(SceneArrived(describe_scene(scene, serial, "room")))
        assert [each.photos for each in desk.asked if isinstance(each, ShowPhotos)] == [scene.photos]
        assert [key for key in desk.world.dropped if key.startswith("view")] == goes and not decoded


def test_a_stage_is_one_whatever_photo_it_is_at() -> None:
    state = replace(State().with_scene(job=Job("Reconstructing")), now=10.0)
    state = Progressed("refinement: photo 1 of 3", 0.5).apply(state)
    assert state.scene.job is not None and state.scene.job.started == 10.0
    state = Progressed("refinement: photo 2 of 3", 0.6).apply(replace(state, now=14.0))
    assert (
        state.scene.job is not None
        and state.scene.job.stage.endswith("2 of 3")
        and state.scene.job.started == 10.0
    )
    state = Progressed("light", 0.7).apply(replace(state, now=16.0))
    assert state.scene.job is not None and state.scene.job.done[-1] == ("refinement", 6.0)
    assert head_of("refinement: photo 1 of 3") == "refinement" == head_of("refinement")
    assert said("refinement: photo 1 of 3").endswith(": photo 1 of 3") != said("refinement")


def test_what_is_left_of_a_job_is_told() -> None:
    job = Job("Reconstructing", "refinement: photo 3 of 9", 0.5, started=20.0, done=(("photos", 10.0),))
    assert tray._seconds(job, 30.0) == "about 20 s left" == tray._seconds(replace(job, done=()), 40.0)
    assert tray._seconds(replace(job, fraction=0.01), 30.0) == "10.0 s"
