"""A second scene merged into the one on show, without a window."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from app.window import commands as do
from app.window.dialogs import Dialog
from app.window.editing import commands as edit
from app.window.editing.placing import Nudge
from app.window.editing.state import Handle, Tool
from app.window.opening import commands as opening
from app.window.scene import commands as show
from app.window.scene import merging
from app.window.scene.state import SceneInfo
from app.window.scene.work import JoinScenes, describe_scene
from langflash_core.errors import InputError
from langflash_core.scene.changes import Moved
from langflash_core.scene.edited import edited_scene
from langflash_core.scene.file import load, save
from langflash_core.scene.mask import Mask
from tests.app.window.scene.test_rooms import Desk
from tests.app.window.scenes import room

COUNT, OTHERS = 12_300, 2500


@pytest.fixture(scope="module")
def info() -> SceneInfo:
    scene = room(torch.eye(3))
    return describe_scene(replace(scene, view_ids=torch.zeros(COUNT, dtype=torch.int64)), 1, "room")


@pytest.fixture
def block(tmp_path: Path) -> Path:
    """The block of the room as a scene of its own."""
    save(
        room(torch.eye(3)).rows(torch.arange(OTHERS)).with_record(atom_names={0: "crate"}),
        tmp_path / "b.langflash",
    )
    return tmp_path / "b.langflash"


@pytest.fixture
def desk(info: SceneInfo) -> Desk:
    desk = Desk()
    desk.perform(show.SceneArrived(info), edit.Found(Mask.first(COUNT, 9), "replace", "here"), edit.Delete())
    desk.asked.clear()
    return desk


def joined(desk: Desk, path: Path, serial: int) -> merging.Merged:
    """What the worker makes of the request."""
    desk.perform(merging.MergeScene(path))
    request = desk.asked[-1]
    assert isinstance(request, JoinScenes)
    return request.run(serial, lambda *_: None, lambda: False)


def test_a_merge_is_an_edit_whose_things_are_selected_with_the_gizmo_in_hand(
    desk: Desk, block: Path, tmp_path: Path
) -> None:
    desk.perform(joined(desk, block, 2))
    state, editing = desk.state, desk.state.editing
    assert state.scene.info is not None and editing.history is not None and editing.marks is not None
    assert (state.scene.info.serial, state.scene.info.name, state.scene.rooms, state.scene.job) == (
        2,
        "room",
        (),
        None,
    )
    assert [each.label for each in editing.history.done] == ["Select 9 here", "Delete 9", "Merge b.langflash"]
    assert editing.marks.selected.rows()[COUNT:].all() and editing.num_selected == OTHERS
    assert (editing.tool, editing.handle) == (Tool.PLACE, Handle.MOVE) and state.scene.flight is not None
    assert editing.unsaved and editing.marks.atoms[3].name == "crate"
    desk.perform(Nudge(right=1))
    nudged = desk.state.editing.marks
    assert nudged is not None and len(nudged.changes) == 1
    whole = edited_scene(state.scene.info.scene, nudged)
    save(whole, tmp_path / "whole.langflash")
    again = load(tmp_path / "whole.langflash")
    assert len(again.gaussians) == COUNT - 9 + OTHERS and again.record.atom_names == {3: "crate"}
    assert again.view_ids is None and bool((again.semantics.weight_ids[-OTHERS:] == 3).all())


def test_what_is_merged_comes_beside_moved_things_in_the_unit_that_was_told(
    info: SceneInfo, tmp_path: Path
) -> None:
    block = room(torch.eye(3)).rows(torch.arange(OTHERS)).with_record(metric_scale=4.0)
    save(block, tmp_path / "b.langflash")
    assert info.history is not None
    moved = Moved(Mask.full(COUNT), offset=(9.0, 0.0, 0.0))
    marks = replace(info.history.marks, metric_scale=2.0, changes=(moved,))
    merged = JoinScenes(info, marks, tmp_path / "b.langflash").run(2, lambda *_: None, lambda: False)
    means = merged.info.scene.gaussians.means
    assert torch.equal(means[:COUNT], info.scene.gaussians.means)
    alone, brought = block.gaussians.means, means[COUNT:]
    torch.testing.assert_close(brought - brought[0], 2 * (alone - alone[0]), rtol=0, atol=1e-4)
    assert float(brought[:, 0].min()) > float(means[:COUNT, 0].quantile(0.98)) + 9


def test_undoing_a_merge_leaves_the_scene_as_it_was_and_another_can_follow(desk: Desk, block: Path) -> None:
    assert desk.state.scene.info is not None and desk.state.editing.marks is not None
    wanted = edited_scene(desk.state.scene.info.scene, desk.state.editing.marks)
    saved = desk.state.editing.unsaved
    desk.perform(joined(desk, block, 2), edit.Undo())
    state = desk.state
    assert state.scene.info is not None and state.editing.marks is not None and state.editing.unsaved == saved
    alone = edited_scene(state.scene.info.scene, state.editing.marks)
    assert torch.equal(alone.gaussians.means, wanted.gaussians.means)
    assert alone.view_ids is not None and wanted.view_ids is not None
    assert torch.equal(alone.view_ids, wanted.view_ids) and alone.record == wanted.record
    assert alone.semantics.num_atoms == 3
    desk.perform(edit.Undo(), edit.Undo())
    assert not desk.state.editing.unsaved
    desk.perform(edit.Redo())  # the selection before the merge; the merge is not done again
    desk.perform(joined(desk, block, 3))
    desk.perform(joined(desk, block, 4))
    state = desk.state
    assert state.scene.info is not None and state.editing.marks is not None
    assert state.scene.info.num_gaussians == COUNT + 2 * OTHERS  # without what was undone
    assert state.scene.info.num_atoms == 9 and len(state.editing.marks.visible) == COUNT + 2 * OTHERS
    desk.perform(edit.Undo())
    assert desk.state.editing.marks is not None
    assert desk.state.editing.marks.there == (COUNT + OTHERS, 6)


def test_a_merge_that_comes_too_late_is_told(desk: Desk, block: Path, info: SceneInfo) -> None:
    late = joined(desk, block, 2)
    desk.perform(show.SceneArrived(replace(info, serial=7)), late)
    assert (
        desk.state.scene.info is not None
        and desk.state.scene.info.serial == 7
        and desk.state.scene.job is None
    )
    assert "merge it again" in desk.state.toasts[-1].text


def test_scenes_of_other_languages_are_refused_in_a_sentence(desk: Desk, tmp_path: Path) -> None:
    other = room(torch.eye(3))
    save(replace(other, semantics=replace(other.semantics, space="clip")), tmp_path / "c.langflash")
    with pytest.raises(InputError, match=r"c\.langflash speaks clip and room speaks minilm"):
        joined(desk, tmp_path / "c.langflash", 2)


def test_a_scene_dropped_on_a_scene_is_asked_about_and_an_opened_one_not(
    info: SceneInfo, block: Path
) -> None:
    desk = Desk()
    desk.perform(show.OpenPaths((str(block),), dropped=True))
    assert desk.state.dialog is None and desk.jobs == ["LoadScene"]  # nothing is there to merge into
    desk.perform(show.SceneArrived(info), show.OpenPaths((str(block),), dropped=True))
    assert desk.state.dialog is Dialog.DROP_SCENE and desk.jobs == ["LoadScene"]
    desk.perform(merging.MergeScene(desk.state.scene.dropped[0]))
    assert desk.state.dialog is None and desk.jobs[-1] == "JoinScenes"
    desk.perform(show.OpenPaths((str(block),)))
    assert desk.jobs[-1] == "LoadScene"


def test_without_a_scene_there_is_nothing_to_merge_into(block: Path) -> None:
    desk = Desk()
    desk.perform(merging.MergeScene(block))
    assert desk.jobs == [] and desk.state.toasts[-1].text == merging.NOTHING_TO_MERGE
    desk.perform(opening.LookInto(dialog=Dialog.MERGE), do.ShowDialog(None))
    assert desk.state.dialog is None
