"""The tray, the jobs, the camera: what their commands do, without a window."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.window import commands as do
from app.window.asking.commands import EditPrompt
from app.window.scene import camera
from app.window.scene import commands as show
from app.window.scene.state import FLIGHT_SECONDS
from app.window.state import State
from langflash_core.geometry.poses import Pose
from langflash_core.images.settings import PHOTO_LIMITS
from langflash_core.scene.file import save
from tests.app.window.scene.test_rooms import Desk
from tests.app.window.scenes import after, told
from tests.app.window.scenes import shown_scene as scene

PATHS = tuple(Path(f"/photos/{name}.jpg") for name in "abc")


def test_photos_are_added_once_and_bounded() -> None:
    paths = tuple(Path(f"{i}.jpg") for i in range(PHOTO_LIMITS.max_photos + 3))
    state = after(State(), show.AddPhotos(paths[:2]), show.AddPhotos(paths[1:3]))
    assert [p.path.name for p in state.scene.photos] == ["0.jpg", "1.jpg", "2.jpg"]
    state = after(state, show.AddPhotos(paths))
    assert len(state.scene.photos) == PHOTO_LIMITS.max_photos
    assert "3 photos were left out" in state.toasts[0].text
    state = after(state, show.RemovePhoto(0))
    assert state.scene.photos[0].path.name == "1.jpg"
    assert after(state, show.ClearPhotos()).scene.photos == ()


def test_reconstruct_needs_photos() -> None:
    state = after(State(), show.Reconstruct())
    assert state.scene.job is None and "no photo" in state.toasts[0].text
    state = after(State(), show.AddPhotos((Path("a.jpg"),)), show.Reconstruct())
    assert state.scene.job is not None


def test_photos_take_a_lens_notes_and_another_place() -> None:
    state = after(State(), show.AddPhotos(PATHS), show.PhotoRead(PATHS[1], 50.0, ("it is dark",)))
    state = after(state, show.SetPhotoFov(0, 500.0), show.MovePhoto(2, 0), show.MovePhoto(9, 0))
    assert [photo.path.stem for photo in state.scene.photos] == ["c", "a", "b"]
    fov = state.scene.photos[1].fov
    assert fov is not None and 0 < fov < 180  # within what a lens can have
    assert (state.scene.photos[2].recorded, state.scene.photos[2].notes) == (50.0, ("it is dark",))
    state = after(state, show.SetPhotoFov(1, None))
    assert state.scene.photos[1].fov is None


def test_the_best_pair_keeps_two_and_is_dropped_when_the_tray_has_changed() -> None:
    two = after(State(), show.AddPhotos(PATHS[:2]), show.ChoosePair())
    assert not two.scene.choosing and "three or more photos" in told(two)
    state = after(State(), show.AddPhotos(PATHS), show.ChoosePair())
    assert state.scene.choosing
    chosen = after(state, show.PairChosen(PATHS, (0, 2)))
    assert [photo.path for photo in chosen.scene.photos] == [PATHS[0], PATHS[2]] and not chosen.scene.choosing
    changed = after(state, show.RemovePhoto(0), show.PairChosen(PATHS, (0, 2)))
    assert len(changed.scene.photos) == 2 and changed.toasts == ()
    assert "No two of these photos match" in told(after(state, show.PairChosen(PATHS, None)))
    assert told(after(state, show.ChoosingFailed("It is damaged."))) == "It is damaged."


def test_progress_files_finished_stages_with_their_seconds() -> None:
    state = after(State(now=1.0), show.AddPhotos((Path("a.jpg"),)), show.Reconstruct())
    state = after(state, do.Tick(2.0), show.Progressed("encoder", 0.0), show.Progressed("encoder", 0.5))
    state = after(state, do.Tick(5.0), show.Progressed("grouping", 7.0))
    assert state.scene.job is not None
    assert state.scene.job.done == (("starting", 1.0), ("encoder", 3.0))
    assert (state.scene.job.stage, state.scene.job.fraction) == ("grouping", 1.0)
    assert after(State(), show.Progressed("late", 0.5)).scene.job is None
    assert after(state, show.CancelJob()).scene.job.cancelling  # type: ignore[union-attr]
    assert after(state, show.JobCancelled()).scene.job is None
    failed = after(state, show.JobFailed("The photos are too dark; use a lamp."))
    assert failed.scene.job is None and failed.toasts[-1].text.startswith("The photos are too dark")


def test_a_scene_is_shown_from_its_first_view(shown: State, info) -> None:
    assert shown.scene.pose == info.views[0] and shown.scene.view == 0
    assert info.num_gaussians == 12_300 and info.num_atoms == 3
    # The block fills the middle of view 0; its front is at z = 0.65.
    assert info.views[0].reach == pytest.approx(0.65, abs=1e-4)
    assert info.warnings == ("The photos overlap little; depth may be off.",)


def test_jumping_flies_and_arrives_exactly(shown: State, info) -> None:
    flying = after(replace(shown, now=10.0), camera.JumpTo(1), do.Tick(10.0 + FLIGHT_SECONDS / 2))
    assert flying.scene.flight is not None and flying.scene.pose not in info.views
    arrived = after(flying, do.Tick(10.01 + FLIGHT_SECONDS))
    assert arrived.scene.flight is None and arrived.scene.pose == info.views[1] and arrived.scene.view == 1
    assert after(shown, camera.JumpTo(7)) == shown
    moved = after(flying, camera.MoveTo(Pose()))
    assert moved.scene.flight is None and moved.scene.view is None and moved.scene.pose == Pose()
    assert after(arrived, camera.Home(), do.Tick(99.0)).scene.pose == info.views[0]


def test_all_of_the_scene_is_framed_and_a_photo_compared() -> None:
    assert after(State(), camera.FrameAll()) == State()
    framed = after(scene(), camera.FrameAll())
    assert framed.scene.flight is not None and framed.scene.flight.end.centre.z < 0  # stands back
    assert after(scene(), camera.Compare(1.5)).scene.compare == 1.0
    assert after(scene(), camera.Compare(None)).scene.compare is None


def test_a_scene_from_a_file_takes_the_photos_of_another_away(shown: State, info, tmp_path: Path) -> None:
    """They would be reconstructed again, or named in an export, as if they were its own."""
    path = tmp_path / "room.langflash"
    save(info.scene, path)
    desk = Desk(after(shown, show.AddPhotos(PATHS)))
    desk.perform(show.OpenPaths((str(path),)))
    assert len(desk.state.scene.photos) == 3  # until it has come: it may be damaged
    arrived = desk.asked[0].run(2, lambda *_: None, lambda: False)
    assert after(desk.state, arrived).scene.photos == ()
    made = after(desk.state, show.SceneArrived(info))
    assert len(made.scene.photos) == 3  # it was made of them


def test_parallel_rays_come_and_go_and_see_from_every_axis(shown: State) -> None:
    flat = after(shown, camera.SwitchRays())
    assert (
        flat.scene.pose.span is not None
        and flat.scene.view is None
        and flat.scene.pose.pivot == pytest.approx(shown.scene.pose.pivot)
    )
    assert after(flat, camera.SwitchRays()).scene.pose.centre == pytest.approx(shown.scene.pose.centre)
    assert after(State(), camera.SwitchRays()) == State()
    for _, forward in camera.SIDES:  # a plan is looked at from anywhere, whatever the photos saw
        there = after(flat, camera.Face(forward), do.Tick(flat.now + FLIGHT_SECONDS + 0.1))
        assert there.scene.pose.axes[:, 2] == pytest.approx(np.array(forward), abs=1e-6)
        assert there.scene.pose.span == flat.scene.pose.span and not there.toasts
    under_way = after(shown, camera.JumpTo(1), camera.SwitchRays())
    landed = after(under_way, do.Tick(under_way.now + FLIGHT_SECONDS + 0.1))
    assert landed.scene.pose.span is not None, "the end of the flight is seen by parallel rays"
    assert landed.scene.pose.pivot == pytest.approx(
        shown.scene.info.views[1].pivot if shown.scene.info else None
    )


def test_what_a_reconstruction_found_is_named_in_the_picture_until_a_phrase_is_asked(info) -> None:
    made = after(State(), show.AddPhotos(PATHS[:2]), show.Reconstruct(), show.SceneArrived(info))
    assert made.asking.named
    opened = after(State(), show.OpenScene(Path("/a.langflash")), show.SceneArrived(info))
    assert not opened.asking.named
    asking = after(State(), EditPrompt(0, "door"), show.AddPhotos(PATHS[:2]), show.Reconstruct())
    assert not after(asking, show.SceneArrived(info)).asking.named
