"""The camera's path: key frames, a flight along them, and what is saved and exported."""

import json
from dataclasses import replace

import numpy as np
import pytest

from app.window import commands as do
from app.window.editing import commands as edit
from app.window.exporting.order import Order, order
from app.window.exporting.process import keys_json
from app.window.filming import commands as film
from app.window.filming.state import MOST_KEYS, read, stored
from app.window.filming.work import PlanTour, way
from app.window.scene import camera
from app.window.scene.near import places_to_keep_to
from app.window.scene.state import FLIGHT_SECONDS
from app.window.state import State
from langflash_core.base import outputs
from langflash_core.geometry import poses
from langflash_core.geometry.poses import Vector, orbit
from langflash_core.geometry.tours import along
from langflash_core.types import Record
from langflash_core.writing.cameras import camera_of
from tests.app.window.scenes import after, of_photos, shown_scene


@pytest.fixture
def shown() -> State:
    return replace(shown_scene(), preferences=replace(State().preferences, near_photos=False))


def with_keys(state: State, count: int = 3) -> State:
    for step in range(count):
        state = after(state, camera.MoveTo(orbit(state.scene.pose, 0.1 * step, 0.02)), film.AddKey())
    return state


def test_key_frames_are_added_and_removed(shown: State) -> None:
    state = with_keys(shown)
    assert len(state.keys) == 3 and state.keys[-1] == state.scene.pose
    assert after(state, film.RemoveKey(0)).keys == state.keys[1:]
    assert after(state, film.RemoveKey()).keys == state.keys[:-1]
    assert after(state, film.RemoveKey(7)).keys == state.keys
    assert after(state, film.ClearKeys(), film.RemoveKey()).keys == ()
    full = with_keys(shown, MOST_KEYS)
    assert len(full.keys) == MOST_KEYS and not full.toasts
    more = with_keys(full, 3)
    assert len(more.keys) == MOST_KEYS and more.toasts[-1].text.startswith("A camera path has at most 50")
    assert with_keys(State(), 2).keys == (), "without a scene there is nothing to film"


def test_key_frames_are_edits_that_are_unsaved_and_undone(shown: State) -> None:
    state = with_keys(shown)
    assert state.editing.unsaved and not shown.editing.unsaved
    for command in (film.RemoveKey(1), film.ClearKeys(), film.AddKey()):
        changed = after(state, command)
        assert changed.keys != state.keys and after(changed, edit.Undo()).keys == state.keys
        assert after(changed, edit.Undo(), edit.Redo()).keys == changed.keys
    assert after(shown, film.ClearKeys()).editing.history == shown.editing.history, "there were none"
    assert not after(state, *[edit.Undo()] * 3).editing.unsaved


def test_a_preview_passes_every_key_frame_and_ends_at_the_last(shown: State) -> None:
    state = with_keys(shown)
    (ready,) = PlanTour(state.keys, 2.0).run(lambda: False)
    assert isinstance(ready, film.TourReady)
    for key, pose in zip(state.keys, (ready.poses[0], ready.poses[30], ready.poses[-1]), strict=True):
        assert pose.centre == pytest.approx(key.centre, abs=1e-5)  # float32 matrices
        assert pose.rotation == pytest.approx(key.rotation, abs=1e-5)
        assert pose.fov == pytest.approx(key.fov, abs=0.3)  # sides of the film are even
    flown = after(state, ready)
    assert flown.filming.tour is not None and after(flown, do.Tick(flown.now + 1.0)).filming.tour is not None
    there = after(flown, do.Tick(flown.now + 2.5))
    assert there.filming.tour is None and there.scene.pose == ready.poses[-1]
    assert after(flown, camera.MoveTo(state.scene.pose)).filming.tour is None, "hands on the picture end it"
    assert after(flown, film.StopTour()).filming.tour is None
    assert after(with_keys(state, 1), ready).filming.tour is None, "the key frames are others by now"


def test_after_a_preview_one_orbits_around_what_the_last_key_frame_looked_at(shown: State) -> None:
    near = replace(shown.scene.pose, reach=shown.scene.pose.reach / 4)
    poses = way((shown.scene.pose, near), 1.0)
    assert poses[0].reach == pytest.approx(shown.scene.pose.reach)
    assert poses[-1].reach == pytest.approx(near.reach)


def test_one_key_frame_is_no_way(shown: State) -> None:
    assert "two or more key frames" in after(with_keys(shown, 1), film.Preview()).toasts[-1].text


def test_key_frames_survive_a_file_and_damaged_ones_are_none(shown: State) -> None:
    keys = with_keys(shown).keys
    assert read(json.loads(json.dumps(stored(keys)))) == keys
    assert read(({"centre": [0, 0]},)) == () and read(()) == ()
    for name, wrong in (
        ("centre", [0.0, float("nan"), 0.0]),
        ("reach", 0.0),
        ("fov", 180.0),
        ("rotation", [0.0] * 4),
    ):
        assert read((*stored(keys[:1]), stored(keys[1:2])[0] | {name: wrong})) == (), name
    assert Record(camera_path=stored(keys)).camera_path


def test_an_export_takes_the_way_that_was_chosen(shown: State) -> None:
    def ordered(state: State, way: str) -> Order | str:
        form = replace(state.exporting.form, what=outputs.VIDEO, way=way, path="/out/film")
        return order(state.with_exporting(form=form))

    keyed = with_keys(shown)
    for state, goes, path in (
        (shown, "", "photos"),
        (keyed, "orbit", "orbit"),
        (keyed, "keys", "/out/film.keys.json"),
        (keyed, "", "/out/film.keys.json"),
    ):
        made = ordered(state, goes)
        assert isinstance(made, Order) and made.request.path == path
        assert (made.camera_file in made.files) == path.endswith("json")
    assert "needs two" in str(ordered(shown, "keys"))


def test_the_preview_is_the_way_of_the_exported_film(shown: State) -> None:
    keys = with_keys(shown).keys
    entries = json.loads(keys_json(keys, 640, 480))
    cameras = along([camera_of(entry, "key") for entry in entries], [0.0, 1.0, 2.0])
    previewed = way(keys, 2.0)
    assert len(cameras) == len(previewed)
    for seen, pose in zip(cameras[::10], previewed[::10], strict=True):
        R, t = seen.viewmat[:3, :3].double().numpy(), seen.viewmat[:3, 3].double().numpy()
        assert -R.T @ t == pytest.approx(np.array(pose.centre), abs=1e-4)  # float32 in the file's way


def test_looking_from_where_no_photo_did_ends_where_the_scene_can_be_trusted() -> None:
    state = of_photos(shown_scene())
    above = after(state, camera.Face(Vector(0.0, 1.0, 0.0)), do.Tick(state.now + FLIGHT_SECONDS))
    assert "No photo was taken from there" in above.toasts[-1].text
    assert poses.degrees_aside(above.scene.pose, places_to_keep_to(above)) == pytest.approx(
        poses.NEAR, abs=1e-6
    )
    front = after(state, camera.Face(Vector(0.0, 0.0, 1.0)))
    assert front.toasts == state.toasts


def test_key_frames_by_parallel_rays_are_saved_and_filmed(shown: State) -> None:
    keys = with_keys(after(shown, camera.SwitchRays())).keys
    assert all(key.span is not None for key in keys)
    assert read(json.loads(json.dumps(stored(keys)))) == keys
    assert read((stored(keys[:1])[0] | {"span": 0.0},)) == ()
    cameras = [camera_of(entry, "key") for entry in json.loads(keys_json(keys, 640, 480))]
    assert all(seen.orthographic for seen in along(cameras, [0.0, 1.0, 2.0]))
    previewed = way(keys, 2.0)
    assert previewed[-1].span == pytest.approx(keys[-1].span, rel=1e-2)  # sides of the film are even


def test_a_film_of_both_kinds_of_rays_is_one_in_perspective(shown: State) -> None:
    keys = (*with_keys(shown, 1).keys, *with_keys(after(shown, camera.SwitchRays()), 1).keys)
    assert not any(entry["orthographic"] for entry in json.loads(keys_json(keys, 640, 480)))
    assert all(pose.span is None for pose in way(keys, 1.0))
