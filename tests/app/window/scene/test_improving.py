"""Improve, without a window: what is offered, what comes of it, and the way back."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from torch import Tensor

from app.window.scene import commands as show
from app.window.scene.improving import Improve, ImproveScene, can_improve
from app.window.scene.state import IMPROVING
from app.window.scene.work import describe_scene
from langflash_core.errors import Cancelled, InputError
from langflash_core.mending.improving import improvable, improve
from langflash_core.splat.refine import Budget
from langflash_core.types import Scene
from tests.app.window.editing.test_mending import Desk
from tests.splat.test_refine import wall

STEPS = 8


def photographed(photos: Tensor | None = None) -> Scene:
    """A wall whose poses and colours are a little off, with its photos in it."""
    scene, own = wall()
    chosen = own if photos is None else photos
    return replace(scene, photos=tuple(png(photo) for photo in chosen))


def png(photo: Tensor) -> bytes:
    stream = io.BytesIO()
    rgb = (photo.movedim(0, -1).clamp(0, 1).numpy() * 255).round().astype(np.uint8)
    Image.fromarray(rgb).save(stream, "PNG")
    return stream.getvalue()


def test_a_held_out_photo_comes_closer_and_the_record_says_so() -> None:
    found = improve(photographed(), Budget(600, STEPS))
    assert found.kept and found.held_out[1] > found.held_out[0]
    assert found.scene.record.refinement["held_out_psnr_db"] == [round(x, 2) for x in found.held_out]


def test_photos_are_brought_to_the_light_of_the_scene_first() -> None:
    scene = photographed()
    plain = improve(scene, Budget(600, 2))
    dark = replace(scene, photos=photographed(wall()[1] * 0.8).photos)
    light = {"gains": [[1.25] * 3] * scene.num_views, "offsets": [[0.0] * 3] * scene.num_views}
    found = improve(dark.with_record(light=light), Budget(600, 2))
    assert found.photos[0] == pytest.approx(plain.photos[0], abs=0.1)
    assert improve(dark, Budget(600, 2)).photos[0] < plain.photos[0] - 0.5


def test_a_scene_without_photos_says_what_to_do() -> None:
    bare = replace(photographed(), photos=())
    assert not improvable(bare)
    with pytest.raises(InputError, match="reconstruct it"):
        improve(bare, Budget(1))


def desk_with(scene: Scene) -> Desk:
    desk = Desk()
    desk.perform(show.SceneArrived(describe_scene(scene, 3, "wall.langflash")))
    desk.work()
    return desk


def test_a_better_scene_takes_the_place_and_the_one_before_is_a_room(folders) -> None:
    desk = desk_with(photographed())
    desk.perform(Improve())
    assert desk.state.scene.job is not None and desk.state.scene.job.title == IMPROVING
    desk.perform(Improve())  # once is enough
    (job,) = [each for each in desk.asked if isinstance(each, ImproveScene)]
    desk.asked.clear()
    desk.perform(replace(job, seconds=1.0).run(8, lambda *_: None, lambda: False))
    scene = desk.state.scene
    assert scene.info is not None and scene.job is None
    assert scene.info.name == "wall (improved)" and scene.info.path is None
    assert "held out" in desk.state.toasts[-1].text
    desk.perform(show.GoToRoom(scene.rooms[0].info.serial))
    assert desk.state.scene.info is not None and desk.state.scene.info.name == "wall.langflash"


def test_where_nothing_is_gained_the_scene_stays(folders) -> None:
    desk = desk_with(photographed())
    before = desk.state.scene.info
    desk.perform(Improve())
    assert before is not None
    said = replace(ImproveScene(before), seconds=1e-6).run(8, lambda *_: None, lambda: False)
    desk.perform(said)
    assert desk.state.scene.info is before and desk.state.scene.job is None
    assert "stays as it is" in desk.state.toasts[-1].text


def test_it_can_be_stopped_and_is_not_offered_where_it_cannot_be() -> None:
    scene = photographed()
    with pytest.raises(Cancelled):
        ImproveScene(describe_scene(scene, 3, "wall")).run(8, lambda *_: None, lambda: True)
    desk = desk_with(replace(scene, photos=()))
    assert not can_improve(desk.state)
    desk.perform(Improve())
    assert desk.state.scene.job is None
