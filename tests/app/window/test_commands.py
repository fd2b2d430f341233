"""Every command as a pure change of a frozen state, without a window."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from app.window import commands as do
from app.window.commands import apply
from app.window.drops import MAX_PHOTOS, sort_drop, typed_path, typed_scene
from app.window.poses import Pose
from app.window.state import FLIGHT_SECONDS, NEGATIVES, TOAST_SECONDS, Mode, State
from app.window.worker import describe_scene
from langflash_core.errors import OutputError
from langflash_core.files import write_atomically
from tests.app.window.scenes import room


def after(state: State, *commands: do.Command) -> State:
    for command in commands:
        state = apply(state, command)
    return state


@pytest.fixture(scope="module")
def info():
    return describe_scene(room(torch.eye(3)), serial=1, name="room")


@pytest.fixture
def shown(info) -> State:
    return after(State(), do.SceneArrived(info))


def test_a_command_leaves_the_old_state_alone() -> None:
    before = State()
    after(before, do.EditPrompt(0, "door"), do.SetMode(Mode.DEPTH), do.Notify("x"))
    assert before == State()


def test_photos_are_added_once_and_bounded() -> None:
    paths = tuple(Path(f"{i}.jpg") for i in range(MAX_PHOTOS + 3))
    state = after(State(), do.AddPhotos(paths[:2]), do.AddPhotos(paths[1:3]))
    assert [p.path.name for p in state.photos] == ["0.jpg", "1.jpg", "2.jpg"]
    state = after(state, do.AddPhotos(paths))
    assert len(state.photos) == MAX_PHOTOS
    assert "3 photos were left out" in state.toasts[0].text
    state = after(state, do.RemovePhoto(0))
    assert state.photos[0].path.name == "1.jpg"
    assert after(state, do.ClearPhotos()).photos == ()


def test_reconstruct_needs_photos() -> None:
    state = after(State(), do.Reconstruct())
    assert state.job is None and "no photo" in state.toasts[0].text
    state = after(State(), do.AddPhotos((Path("a.jpg"),)), do.Reconstruct())
    assert state.job is not None


def test_progress_files_finished_stages_with_their_seconds() -> None:
    state = after(State(now=1.0), do.AddPhotos((Path("a.jpg"),)), do.Reconstruct())
    state = after(state, do.Tick(2.0), do.Progressed("encoder", 0.0), do.Progressed("encoder", 0.5))
    state = after(state, do.Tick(5.0), do.Progressed("grouping", 7.0))
    assert state.job is not None
    assert state.job.done == (("starting", 1.0), ("encoder", 3.0))
    assert (state.job.stage, state.job.fraction) == ("grouping", 1.0)
    assert after(State(), do.Progressed("late", 0.5)).job is None
    assert after(state, do.CancelJob()).job.cancelling  # type: ignore[union-attr]
    assert after(state, do.JobCancelled()).job is None
    failed = after(state, do.JobFailed("The photos are too dark; use a lamp."))
    assert failed.job is None and failed.toasts[-1].text.startswith("The photos are too dark")


def test_a_scene_is_shown_from_its_first_view(shown: State, info) -> None:
    assert shown.pose == info.views[0] and shown.view == 0
    assert info.num_gaussians == 12_300 and info.num_atoms == 3
    # The block fills the middle of view 0; its front is at z = 0.65.
    assert info.views[0].reach == pytest.approx(0.65, abs=1e-4)
    assert info.warnings == ("The photos overlap little; depth may be off.",)


def test_jumping_flies_and_arrives_exactly(shown: State, info) -> None:
    flying = after(replace(shown, now=10.0), do.JumpTo(1), do.Tick(10.0 + FLIGHT_SECONDS / 2))
    assert flying.flight is not None and flying.pose not in info.views
    arrived = after(flying, do.Tick(10.01 + FLIGHT_SECONDS))
    assert arrived.flight is None and arrived.pose == info.views[1] and arrived.view == 1
    assert after(shown, do.JumpTo(7)) == shown
    moved = after(flying, do.MoveTo(Pose()))
    assert moved.flight is None and moved.view is None and moved.pose == Pose()
    assert after(arrived, do.Home(), do.Tick(99.0)).pose == info.views[0]


def test_the_first_phrase_turns_the_heat_map_on_and_only_the_first() -> None:
    state = after(State(), do.EditPrompt(0, "d"))
    assert state.mode is Mode.HEAT
    state = after(state, do.SetMode(Mode.RGB), do.EditPrompt(0, "do"))
    assert state.mode is Mode.RGB
    assert after(State(), do.EditPrompt(0, "  ")).mode is Mode.RGB


def test_prompts_are_edited_by_key() -> None:
    state = after(State(), do.EditPrompt(0, "door"), do.AddPrompt())
    second = state.prompts[1]
    assert second.colour != state.prompts[0].colour and state.active == second.key
    state = after(state, do.EditPrompt(second.key, "floor"), do.ShowPrompt(second.key, False))
    assert [p.text for p in state.asked] == ["door"]
    assert state.active_prompt == state.prompts[0]
    state = after(state, do.RemovePrompt(0), do.RemovePrompt(second.key))
    assert len(state.prompts) == 1 and state.prompts[0].text == "" and state.active_prompt is None


def test_found_follows_the_threshold_in_force() -> None:
    state = after(State(), do.EditPrompt(0, "door"))
    assert state.prompts[0].found is None
    state = after(state, do.Calibrated(0.8), do.Answered(((0, "door", 0.7), (99, "x", 0.9))))
    assert state.prompts[0].found is False
    assert after(state, do.SetThreshold(0, 0.6)).prompts[0].found is True
    back = after(state, do.SetThreshold(0, 0.6), do.SetThreshold(0, None))
    assert back.prompts[0].cut == 0.8
    edited = after(state, do.EditPrompt(0, "doors"))
    assert edited.prompts[0].score is None
    assert after(edited, do.Answered(((0, "door", 0.7),))).prompts[0].score is None  # of the old text


def test_negatives_and_what_needs_weight_maps() -> None:
    state = after(State(), do.SetNegatives(("thing",)))
    assert state.negatives == ("thing",) and State().negatives == NEGATIVES
    assert not after(State(), do.SetMode(Mode.HEAT)).wants_maps
    assert after(State(), do.SetMode(Mode.ATOMS)).wants_maps
    asked = after(State(), do.EditPrompt(0, "door"))
    assert asked.wants_maps and after(asked, do.SetMode(Mode.DEPTH)).wants_maps  # it has no score yet
    answered = after(asked, do.Answered(((0, "door", 0.9),)), do.SetMode(Mode.DEPTH))
    assert answered.prompts[0].score == 0.9 and not answered.wants_maps


def test_toasts_are_shown_once_expire_and_close() -> None:
    state = after(State(now=3.0), do.Notify("a"), do.Notify("b", "info"), do.Notify("a"))
    assert [t.text for t in state.toasts] == ["b", "a"]
    assert [t.text for t in after(state, do.Tick(3.0 + TOAST_SECONDS["info"])).toasts] == ["a"]
    assert after(state, do.DismissToast(state.toasts[1].key)).toasts == state.toasts[:1]


def test_leaving_asks_while_a_scene_is_unsaved(shown: State) -> None:
    assert after(State(), do.Leave()).leaving
    asked = after(shown, do.Leave())
    assert not asked.leaving and asked.dialog == "leave"
    assert after(asked, do.Leave(sure=True)).leaving
    assert after(shown, do.SceneSaved(Path("s.langflash")), do.Leave()).leaving


def test_the_save_dialog_proposes_a_place(shown: State) -> None:
    state = after(shown, do.AddPhotos((Path("/p/left.jpg"),)), do.ShowDialog("save"))
    assert state.dialog_path == str(Path("/p/left.langflash"))
    saved = after(state, do.SceneSaved(Path("/q/s.langflash")), do.ShowDialog("save"))
    assert saved.dialog_path == str(Path("/q/s.langflash"))
    assert "no scene to save" in after(State(), do.SaveScene(Path("s"))).toasts[0].text


def test_paths_that_no_disk_takes_are_said_to_be_missing() -> None:
    long = "a" * 300  # of a name most file systems take 255 bytes
    assert typed_scene(long) == Path(f"{long}.langflash")  # writing it fails, with a sentence
    assert sort_drop([long, "nul\0"]).rejected == tuple(
        f"{path} does not exist; check the path." for path in (long, "nul\0")
    )
    with pytest.raises(OutputError, match="too long; choose another place"):
        write_atomically(Path(f"{long}.langflash"), b"")


def test_typed_paths_name_a_scene_or_nothing(tmp_path: Path) -> None:
    assert [typed_scene(text) for text in ("", "  ", "/", "~", str(tmp_path))] == [None] * 5
    assert typed_scene(" room ") == Path("room.langflash")
    assert typed_scene("~/a.scene") == Path.home() / "a.scene"
    assert typed_path("~nobody-here/x") == Path("~nobody-here/x")


def test_drops_are_sorted(tmp_path: Path) -> None:
    folder = tmp_path / "a room"
    folder.mkdir()
    for name in ("b.JPG", "a.heic", "notes.txt", ".hidden.jpg"):
        (folder / name).touch()
    scene, text, empty = tmp_path / "s.langflash", tmp_path / "t.txt", tmp_path / "empty"
    scene.touch()
    text.touch()
    empty.mkdir()
    drop = sort_drop([folder, scene, text, empty, tmp_path / "gone.jpg", folder / "b.JPG"])
    assert [p.name for p in drop.photos] == ["a.heic", "b.JPG"]
    assert [p.name for p in drop.scenes] == ["s.langflash"]
    (tmp_path / "bonsai.PLY").touch()
    assert [p.name for p in sort_drop([tmp_path / "bonsai.PLY"]).scenes] == ["bonsai.PLY"]
    assert [s.split(" ")[0] for s in drop.rejected[:1]] == ["t.txt"]
    assert "holds no photo" in drop.rejected[1] and "does not exist" in drop.rejected[2]
