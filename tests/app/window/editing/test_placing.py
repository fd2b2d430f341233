"""Moving, turning, scaling and recolouring what is selected, as pure changes of a frozen state."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from imgui_bundle import ImVec2

from app.window.asking.commands import AtomsWeighed
from app.window.asking.work import WeighAtoms
from app.window.editing import commands as edit
from app.window.editing import placing
from app.window.editing import pointing as point
from app.window.editing.panels.gizmo import projection_of, view_of
from app.window.editing.placing import Adjust, BeginTint, EndGesture, Nudge, SetHandle, ShowTint
from app.window.editing.state import Handle, Tint, Tool
from app.window.editing.things import ThingFound
from app.window.editing.work import FindThing
from app.window.frame import table
from app.window.scene import commands as show
from app.window.scene.memory import SceneMemory
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.geometry import poses
from langflash_core.geometry.harmonics import sh_to_colour
from langflash_core.geometry.poses import Vector
from langflash_core.scene import edits as core
from langflash_core.scene.changed import changed_scene
from langflash_core.scene.changes import Moved, turn_about
from langflash_core.scene.edited import edited_scene
from langflash_core.scene.mask import Mask
from tests.app.window.scenes import CHAIR, after, labels, room

BLOCK = Mask.first(12_300, 2500)  # the first rows of the room are its block


@pytest.fixture(scope="module")
def info():
    return describe_scene(room(torch.eye(3, 384)), serial=1, name="room")


@pytest.fixture
def chosen(info) -> State:
    """With the block selected and the gizmo in hand."""
    return after(
        State(), show.SceneArrived(info), edit.Found(BLOCK, "replace", "here"), SetHandle(Handle.MOVE)
    )


def means(state: State) -> np.ndarray:
    assert state.scene.info is not None and state.editing.marks is not None
    return changed_scene(state.scene.info.scene, state.editing.marks).gaussians.means.numpy()


def test_a_gesture_is_one_edit_however_often_the_hand_moves(chosen: State) -> None:
    before = means(chosen)
    for x in (0.1, 0.2, 0.3):
        chosen = after(chosen, Adjust(Moved(BLOCK, offset=(x, 0.0, 0.0))))
        assert labels(chosen) == ["Select 2,500 here"] and np.array_equal(means(chosen), before)
    made = after(chosen, EndGesture())
    assert labels(made)[1:] == ["Move 2,500"] and made.editing.unsaved and made.editing.gesture is None
    # float32 places of about 1
    np.testing.assert_allclose(means(made)[:2500], before[:2500] + np.array((0.3, 0, 0)), atol=1e-6)
    assert np.array_equal(means(made)[2500:], before[2500:])
    assert np.array_equal(means(after(made, edit.Undo())), before)
    assert labels(after(chosen, EndGesture(keep=False))) == ["Select 2,500 here"]
    assert labels(after(chosen, Adjust(Moved(BLOCK)), EndGesture()))[1:] == []  # back where it was


def test_what_is_not_selected_or_no_longer_does_not_move(chosen: State) -> None:
    other = Moved(Mask.first(12_300, 7), offset=(1.0, 0.0, 0.0))
    assert after(chosen, Adjust(other)).editing.gesture is None
    begun = after(chosen, Adjust(Moved(BLOCK, offset=(1.0, 0.0, 0.0))))
    for ends in (edit.Undo(), edit.Deselect(), point.SetTool(Tool.BOX), SetHandle(Handle.TURN)):
        assert after(begun, ends).editing.gesture is None
    assert after(State(), Nudge(right=1), EndGesture(), BeginTint()) == State()


def test_numbers_and_matrices_say_the_same_gesture(chosen: State) -> None:
    assert chosen.scene.info is not None and chosen.editing.marks is not None
    marks, rest = chosen.editing.marks, Moved(BLOCK)
    pivot = placing.pivot_of(chosen.scene.info, marks)
    assert pivot is not None
    np.testing.assert_allclose(pivot, (CHAIR[0], CHAIR[1], CHAIR[2] - 0.2), atol=1e-6)  # of the block's front
    for handle, numbers in (
        (Handle.MOVE, (0.1, -0.2, 0.3)),
        (Handle.TURN, (10.0, -70.0, 25.0)),
        (Handle.SCALE, (1.7,)),
    ):
        gesture = placing.of_numbers(numbers, marks, pivot, handle)
        np.testing.assert_allclose(placing.numbers_of(gesture, pivot, handle), numbers, atol=1e-9)
        again = placing.from_matrix(placing.to_matrix(gesture, pivot), pivot, handle, rest)
        np.testing.assert_allclose(placing.numbers_of(again, pivot, handle), numbers, atol=1e-9)
    pulled = placing.to_matrix(None, pivot) @ np.diag((1.0, 2.0, 1.0, 1.0))
    assert placing.from_matrix(pulled, pivot, Handle.SCALE, rest).scale == pytest.approx(2.0)
    for broken in (np.full((4, 4), np.nan), np.zeros((4, 4))):
        assert placing.from_matrix(broken, pivot, Handle.SCALE, rest) is rest


def test_keys_move_turn_and_scale_by_steps_as_the_picture_shows_it(chosen: State) -> None:
    before = means(chosen)[:2500]
    moved = means(after(chosen, Nudge(right=1)))[:2500] - before
    assert (moved[:, 0] > 0.01).all() and np.abs(moved[:, 1:]).max() < 1e-6  # from the first photo: along x
    turned = after(chosen, SetHandle(Handle.TURN), Nudge(right=1), Nudge(right=1))
    change = turned.editing.marks and turned.editing.marks.changes[-1]
    assert isinstance(change, Moved) and labels(turned)[-2:] == ["Turn 2,500", "Turn 2,500"]
    np.testing.assert_allclose(change.turn, turn_about((0, -1, 0), 10.0), atol=1e-12)
    larger = after(chosen, SetHandle(Handle.SCALE), Nudge(down=-1))
    assert np.ptp(means(larger)[:2500, 0]) == pytest.approx(1.05 * np.ptp(before[:, 0]), rel=1e-5)
    entry = table.named("Nudge the selection: left")
    assert entry.key == "Ctrl+Left" and entry.make(chosen) == Nudge(right=-1)
    assert entry.make(after(chosen, point.SetTool(Tool.MOVE))) is None


def test_a_step_of_a_key_is_as_far_by_parallel_rays(chosen: State) -> None:
    far = poses.orthographic(chosen.scene.pose, Vector(-9.0, -9.0, -9.0), Vector(9.0, 9.0, 9.0))
    assert far.reach > 5 * chosen.scene.pose.reach, "it stands clear of the scene"
    flat = means(after(chosen.with_scene(pose=far), Nudge(right=1))) - means(chosen)
    plain = means(after(chosen, Nudge(right=1))) - means(chosen)
    np.testing.assert_allclose(flat, plain, atol=1e-6)  # float32 places


def test_some_of_a_large_selection_tell_its_middle_and_its_brightness(chosen: State, monkeypatch) -> None:
    info, marks = chosen.scene.info, chosen.editing.marks
    assert info is not None and marks is not None
    pivot, luma = placing.pivot_of(info, marks), placing.luma_of(info, marks)
    monkeypatch.setattr(placing, "_ENOUGH", 400)
    info = replace(info, memory=SceneMemory(info.scene))  # which has answered nothing
    some = placing.pivot_of(info, marks)
    assert pivot is not None and some is not None
    np.testing.assert_allclose(some, pivot, atol=0.05)  # of a block .6 wide
    assert abs(placing.luma_of(info, marks) - luma) < 0.05


def test_a_number_that_is_none_moves_nothing(chosen: State) -> None:
    assert chosen.editing.marks is not None
    for handle, numbers in ((Handle.TURN, (math.inf, 0.0, 0.0)), (Handle.SCALE, (math.nan,))):
        assert placing.of_numbers(numbers, chosen.editing.marks, (0.0, 0.0, 0.0), handle).still


def test_a_tint_is_shown_made_undone_and_saved(chosen: State) -> None:
    assert chosen.scene.info is not None and chosen.editing.marks is not None
    luma = placing.luma_of(chosen.scene.info, chosen.editing.marks)
    blue = Tint((0.1, 0.2, 0.9), 1.0)
    shown = after(chosen, BeginTint(), ShowTint(blue, luma))
    assert shown.editing.tint == blue and not shown.editing.placing and labels(shown)[1:] == []
    made = after(shown, EndGesture())
    assert labels(made)[1:] == ["Recolour 2,500"] and made.editing.tint is None
    assert made.scene.info is not None and made.editing.marks is not None
    scene = edited_scene(made.scene.info.scene, made.editing.marks)
    ahead = torch.tensor([0.0, 0.0, 1.0]).expand(12_300, 3)
    colours = sh_to_colour(scene.gaussians.sh, ahead)
    # On average the tint; the block's own two shades of red stay two shades of blue.
    np.testing.assert_allclose(colours[:2500].mean(0), blue.colour, atol=1e-4)
    assert np.ptp(colours[:2500, 2].numpy()) > 0.1
    assert torch.equal(scene.gaussians.sh[2500:], made.scene.info.scene.gaussians.sh[2500:])
    assert after(made, edit.Undo(), edit.Undo()).editing.unsaved is False
    assert after(shown, EndGesture(keep=False)).editing.unsaved is False
    assert after(made, BeginTint()).editing.tint == blue  # the last colour is offered again


def test_moved_things_are_found_where_they_are(chosen: State, info) -> None:
    made = after(chosen, Adjust(Moved(BLOCK, offset=(0.5, 0.0, 0.0))), EndGesture(), edit.Deselect())
    marks = made.editing.marks
    assert marks is not None
    size, focal = (224, 168), 0.5 * 224 / np.tan(np.radians(30))
    at = (112 + focal * (CHAIR[0] + 0.5) / (CHAIR[2] - 0.2), 84 + focal * CHAIR[1] / (CHAIR[2] - 0.2))
    *_, found = FindThing(1, info.memory, marks, at, made.scene.pose, size, "replace").run(lambda: False)
    assert isinstance(found, ThingFound) and len(found.levels[found.chosen] & BLOCK) == 2500
    (weighed,) = WeighAtoms(1, info.scene, marks).run(lambda: False)
    assert isinstance(weighed, AtomsWeighed) and weighed.places[0] is not None
    assert weighed.places[0].x == pytest.approx(CHAIR[0] + 0.5, abs=0.05)
    (weighed,) = WeighAtoms(1, info.scene, core.delete(marks, BLOCK)).run(lambda: False)
    assert isinstance(weighed, AtomsWeighed) and weighed.places[0] is None, "nothing of it is left"
    seen = after(made, edit.Found(BLOCK, "replace", "here"), point.FrameSelection())
    assert seen.scene.flight is not None and seen.scene.flight.end.pivot[0] == pytest.approx(
        CHAIR[0] + 0.5, abs=0.1
    )


@pytest.mark.parametrize("parallel", [False, True])
def test_the_gizmo_stands_where_the_picture_shows_the_thing(chosen: State, parallel: bool) -> None:
    """Its projection, with the principal point and the rays of the pose, against the camera's own."""
    size, points = ImVec2(640, 400), np.array([[0.1, -0.2, 1.5], [-0.3, 0.1, 0.9]])
    pose = replace(chosen.scene.pose, shift=(0.1, -0.2), span=3.0 if parallel else None)
    clip = np.c_[points, np.ones(2)] @ (projection_of(pose, size) @ view_of(pose)).T
    seen = poses.project(points, pose, (640, 400))
    assert seen is not None
    x = (clip[:, 0] / clip[:, 3] + 1) / 2 * 640
    y = (1 - clip[:, 1] / clip[:, 3]) / 2 * 400
    np.testing.assert_allclose(np.c_[x, y], seen[1], atol=1e-9)


def test_the_oldest_step_that_falls_off_is_told_once(chosen: State, monkeypatch) -> None:
    monkeypatch.setattr(core, "MOST_EDITS", 3)
    bounded = core.History.drop_oldest
    monkeypatch.setattr(core.History, "drop_oldest", lambda self: bounded(self, most_edits=3))
    told = 0
    for _ in range(6):
        before = chosen.toasts
        chosen = after(chosen, Nudge(right=1))
        told += chosen.toasts != before
    assert told == 1 and chosen.toasts[-1].text == edit.FELL_OFF
    assert chosen.editing.history is not None and chosen.editing.history.forgotten == 4
    while table.named("Undo").make(chosen):
        chosen = after(chosen, edit.Undo())
    assert chosen.editing.unsaved  # the forgotten steps are still to be saved
