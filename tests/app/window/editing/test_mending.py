"""Hiding for good and filling, without a window: what comes of them, what is kept, and what is not."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import torch

from app.places import state_folder
from app.window.commands import Tick
from app.window.editing import commands as edit
from app.window.editing import mending, placing
from app.window.editing import pointing as point
from app.window.editing.effects import EditingEffects
from app.window.editing.state import Region, Tool
from app.window.recovery import edits
from app.window.recovery.effects import KEEP_AFTER
from app.window.recovery.records import EDITED
from app.window.recovery.work import KeepCopy
from app.window.requests import Task
from app.window.scene import commands as show
from app.window.scene.effects import SceneEffects
from app.window.scene.work import describe_scene
from langflash_core.errors import InputError
from langflash_core.mending.hiding import preview
from langflash_core.mending.looks import draw_scene
from langflash_core.mending.settings import RECIPE_DEFAULTS
from langflash_core.scene.changes import Moved
from langflash_core.scene.file import load, save
from langflash_core.scene.mask import Mask
from tests.app.window.desk import Desk as Keeping
from tests.app.window.desk import Nothing
from tests.app.window.scenes import room

COUNT, BLOCK = 12_300, 2500


class Pictured(Nothing):
    """A picture's place of twice the room's views."""

    size = (448, 336)


class Desk(Keeping):
    """With the effects of scene, editing and recovery."""

    def __post_init__(self) -> None:
        super().__post_init__()
        nothing: Any = Pictured()
        scene = SceneEffects(self.hands, nothing, nothing, print)
        self.followers = (scene, EditingEffects(self.hands, nothing), self.effects)

    def work(self, serial: int = 7, without: tuple[str, ...] = ("NameAtoms", "Thin")) -> None:
        """But for words and what only draws."""
        super().work(serial, without)

    def rest(self) -> None:
        self.perform(Tick(self.state.now + 2 * KEEP_AFTER))
        self.effects.tick(self.state, self.state.now)
        self.written()
        self.work()


@pytest.fixture
def desk(folders: Path, tmp_path: Path) -> Iterator[Desk]:
    """The room, out of its file, its block selected, and that kept."""
    save(room(torch.eye(3)), tmp_path / "room.langflash")
    scene = load(tmp_path / "room.langflash")
    desk = Desk()
    desk.perform(show.SceneArrived(describe_scene(scene, 1, "room.langflash", tmp_path / "room.langflash")))
    desk.perform(edit.Found(Mask.first(COUNT, BLOCK), "replace", "here"))
    desk.rest()
    yield desk
    desk.effects.close(desk.state, crashed=False)


def kept_of(path: Path) -> list[bytes]:
    """All files of a folder; the writer's thread may remove one meanwhile."""
    found = []
    for file in path.rglob("*"):
        with suppress(FileNotFoundError):
            found += [file.read_bytes()] if file.is_file() else []
    return found


def test_a_hole_is_filled_as_one_edit(desk: Desk) -> None:
    desk.perform(mending.FillSelection())
    assert desk.state.scene.job is not None
    desk.work()
    editing = desk.state.editing
    assert editing.history is not None and editing.marks is not None and desk.state.scene.info is not None
    assert editing.history.done[-1].label == f"Delete and fill {editing.num_deleted:,}"
    assert editing.marks.deleted.rows()[:BLOCK].all() and editing.num_deleted < 1.5 * BLOCK
    assert editing.marks.there[0] >= COUNT and not editing.num_selected
    assert desk.state.scene.job is None and desk.state.scene.rooms == ()
    desk.perform(edit.Undo())
    marks = desk.state.editing.marks
    assert (
        marks is not None and not marks.deleted and marks.there == (COUNT, 3) and len(marks.selected) == BLOCK
    )


def test_a_copy_lies_where_it_was_shown_with_the_gizmo_in_hand(desk: Desk) -> None:
    moved = Moved(Mask.first(COUNT, BLOCK), offset=(0.1, 0.0, 0.0))
    desk.perform(placing.Adjust(moved), placing.EndGesture(), mending.CopySelection())
    desk.work()
    info, editing = desk.state.scene.info, desk.state.editing
    assert info is not None and editing.marks is not None and editing.history is not None
    assert editing.history.done[-1].label == f"Copy {BLOCK:,}" and editing.tool is Tool.PLACE
    assert editing.marks.selected.rows()[COUNT:].all() and editing.num_selected == BLOCK
    means = info.memory.changed(editing.marks).gaussians.means
    assert torch.allclose(means[COUNT:], means[:BLOCK])
    desk.perform(edit.Undo())
    assert desk.state.editing.marks is not None and desk.state.editing.marks.there == (COUNT, 3)


@pytest.mark.parametrize("how", ["blur", "remove"])
def test_what_is_hidden_is_another_scene_until_then_undone_at_once(desk: Desk, how: str) -> None:
    before = desk.state.scene.info
    desk.perform(mending.AskToHide(how))
    assert desk.state.editing.hiding is not None and desk.state.editing.hiding.how == how
    desk.perform(mending.HideForGood(how, RECIPE_DEFAULTS.margin))
    desk.work()
    scene = desk.state.scene
    assert (
        scene.info is not None and scene.info.serial == 7 and scene.info.path is None and before is not None
    )
    assert desk.state.editing.history is not None and not desk.state.editing.history.done
    assert scene.unhidden is not None and scene.unhidden.info.scene is before.scene
    assert any("Ctrl+Z brings it back" in toast.text for toast in desk.state.toasts)
    means = {row.tobytes() for row in scene.info.scene.gaussians.means.numpy()}
    assert not any(row.tobytes() in means for row in before.scene.gaussians.means[:BLOCK].numpy())
    desk.perform(mending.BringBack())
    again = desk.state
    assert again.scene.info is not None and again.scene.info.scene is before.scene
    assert again.editing.num_selected == BLOCK and again.scene.unhidden is None


def test_the_margin_is_seen_before_and_hidden_as_it_was_seen(desk: Desk) -> None:
    """The window hid with the usual margin, and showed none of it before."""
    info, marks = desk.state.scene.info, desk.state.editing.marks
    assert info is not None and marks is not None
    desk.perform(mending.AskToHide("blur"))
    asked = desk.state.editing.hiding
    assert asked is not None and asked.margin == RECIPE_DEFAULTS.margin and asked.mask(marks) is None
    desk.work()
    counts = []
    for margin in (0.0, RECIPE_DEFAULTS.margin, 0.1, 7.0):
        desk.perform(mending.SetMargin(margin), mending.AskToHide("pixels"))
        asked = desk.state.editing.hiding
        assert (
            asked is not None and asked.margin == min(margin, RECIPE_DEFAULTS.most_margin) and not desk.asked
        )
        found = asked.mask(marks)
        assert found is not None and not marks.selected - found
        counts.append(len(found))
    slow = preview(info.scene, torch.from_numpy(marks.selected.rows()), draw_scene, 0.1)
    assert counts[2] == int(slow.sum()) and BLOCK <= counts[0] < counts[1] < counts[2] < counts[3] < COUNT
    desk.perform(mending.SetMargin(0.1), mending.HideForGood("pixels", 0.1))
    desk.work()
    hidden = desk.state
    assert f"Hidden: {counts[2]:,} Gaussians" in hidden.toasts[-1].text and hidden.editing.hiding is None
    assert hidden.editing.margin == 0.1  # the next part is asked about with it


def test_the_margin_is_looked_for_again_where_the_selection_is_another(desk: Desk) -> None:
    desk.perform(mending.AskToHide("blur"))
    late = desk.asked.pop()
    desk.perform(edit.Found(Mask.first(COUNT, BLOCK // 2), "replace", "here"))
    assert isinstance(late, Task)
    desk.perform(*late.run(lambda: False))  # comes too late
    asked, marks = desk.state.editing.hiding, desk.state.editing.marks
    assert asked is not None and marks is not None and asked.mask(marks) is None
    desk.work()
    asked = desk.state.editing.hiding
    assert asked is not None and (found := asked.mask(marks)) is not None and not marks.selected - found
    desk.perform(edit.Deselect(), mending.AskToHide(""))
    assert desk.state.editing.hiding is None and not desk.asked


def test_once_saved_nothing_on_the_disk_brings_it_back(desk: Desk, tmp_path: Path) -> None:
    secret = [row.tobytes() for row in room(torch.eye(3)).gaussians.means[:BLOCK:50].numpy()]
    assert any(each in content for content in kept_of(state_folder()) for each in secret)
    desk.perform(mending.HideForGood("blur", RECIPE_DEFAULTS.margin))
    desk.work()
    desk.rest()
    assert not any(each in content for content in kept_of(state_folder()) for each in secret)
    desk.perform(show.SaveScene(tmp_path / "room.langflash"))
    desk.work()
    desk.rest()
    assert desk.state.scene.unhidden is None
    for content in (*kept_of(state_folder()), (tmp_path / "room.langflash").read_bytes()):
        assert not any(each in content for each in secret)
    desk.perform(mending.BringBack())
    assert desk.state.scene.info is not None and desk.state.scene.info.serial == 7


def shows(path: Path) -> int:
    """How many files of a folder hold what was hidden first."""
    secret = [row.tobytes() for row in room(torch.eye(3)).gaussians.means[:BLOCK:50].numpy()]
    return sum(any(each in content for each in secret) for content in kept_of(path))


def copied(desk: Desk) -> None:
    """Something else becomes of the hidden scene, which makes another one of it."""
    marks = desk.state.editing.marks
    assert marks is not None
    desk.perform(edit.Found(Mask.first(marks.deleted.count, 300), "replace", "it"), mending.CopySelection())
    desk.work(8)


def visited(desk: Desk) -> None:
    """Another scene is opened, and the hidden one gone back to."""
    assert desk.state.scene.info is not None
    serial = desk.state.scene.info.serial
    desk.perform(
        show.SceneArrived(describe_scene(room(torch.eye(3)).rows(torch.arange(8000, COUNT)), 8, "b"))
    )
    desk.perform(show.GoToRoom(serial))
    desk.work(9)
    assert desk.state.scene.info.serial == serial and desk.state.scene.unhidden is not None


def hidden_again(desk: Desk) -> None:
    """More is hidden, and that brought back; then hidden again."""
    marks = desk.state.editing.marks
    assert marks is not None
    desk.perform(edit.Found(Mask.first(marks.deleted.count, 300), "replace", "more"))
    desk.perform(mending.HideForGood("blur", RECIPE_DEFAULTS.margin))
    desk.work(8)
    desk.perform(mending.BringBack())
    assert desk.state.scene.unhidden is None and desk.state.editing.num_selected == 300
    desk.perform(mending.HideForGood("blur", RECIPE_DEFAULTS.margin))
    desk.work(9)


@pytest.mark.parametrize("then", [lambda desk: None, copied, visited, hidden_again])
def test_whatever_follows_nothing_that_the_program_kept_shows_it_once_it_is_saved(
    desk: Desk, tmp_path: Path, then: Callable[[Desk], None]
) -> None:
    """Edits of an earlier session, what this one and one that crashed exported of."""
    info, history = desk.state.scene.info, desk.state.editing.history
    assert info is not None and history is not None
    edits.keep(info.scene, history, info.name, info.path, "earlier")
    for file in desk.keeper.copies[1:]:  # as the dialog of exports has it done
        desk.asked.append(KeepCopy(info.serial, info.scene, file, history.marks))
    desk.work()
    save(info.scene, state_folder() / f"session-1-dead{EDITED}")
    assert shows(state_folder()) == 5
    desk.perform(mending.HideForGood("blur", RECIPE_DEFAULTS.margin))
    desk.work()
    then(desk)
    desk.perform(show.SaveScene(tmp_path / "room.langflash"))
    desk.work(11)
    desk.rest()
    assert shows(tmp_path) == 0
    scene = desk.state.scene
    assert scene.unhidden is None and not scene.shown_by
    assert all(each.info.path is None and each.unhidden is None for each in scene.rooms)


def test_what_was_edited_meanwhile_is_not_lost(desk: Desk) -> None:
    desk.perform(mending.HideForGood("blur", RECIPE_DEFAULTS.margin))
    desk.perform(edit.Delete())
    desk.work()
    assert desk.state.scene.info is not None and desk.state.scene.info.serial == 1
    assert any("edited in the meantime" in toast.text for toast in desk.state.toasts)


def test_without_a_selection_nothing_happens(desk: Desk) -> None:
    desk.perform(edit.Deselect())
    before = desk.state
    desk.perform(
        mending.AskToHide(), mending.HideForGood("blur", RECIPE_DEFAULTS.margin), mending.FillSelection()
    )
    assert desk.state == before and not desk.asked


def test_a_stroke_of_the_clone_brush_is_one_edit_and_the_next_begins_at_the_same_source(desk: Desk) -> None:
    at = (340.0, 120.0)  # on the wall, right of the block
    stroke = mending.CloneStroke(Region((at, (352.0, 126.0)), 14.0))
    desk.perform(point.SetTool(Tool.CLONE), stroke)
    assert desk.state.scene.job is None and not desk.state.editing.draws
    desk.perform(mending.PickSource((-0.15, 0.1, 0.65)), mending.PickSource(None), stroke)
    assert desk.state.scene.job is not None and desk.state.editing.draws
    desk.perform(stroke)  # while the first is under way: not lost, and not twice
    assert sum(type(each).__name__ == "ClonePart" for each in desk.asked) == 1
    desk.work()
    editing, info = desk.state.editing, desk.state.scene.info
    assert editing.history is not None and editing.marks is not None and info is not None
    brought = editing.marks.there[0] - COUNT
    assert editing.history.done[-1].label == f"Clone {brought:,}" and brought > 50
    assert (
        editing.source == (-0.15, 0.1, 0.65) and editing.tool is Tool.CLONE and editing.num_selected == BLOCK
    )
    assert bool((info.scene.semantics.weight_ids[COUNT:] == 0).all())  # means what it was copied from
    assert float((info.scene.gaussians.means[COUNT:, 2] - 1.3).abs().max()) < 1e-4
    assert editing.num_deleted > 10 and not editing.marks.deleted.rows()[:BLOCK].any()
    desk.rest()
    desk.perform(edit.Undo())
    marks = desk.state.editing.marks
    assert marks is not None and marks.there == (COUNT, 3) and not marks.deleted
    desk.perform(edit.Redo(), stroke)
    desk.work(8)
    marks = desk.state.editing.marks
    assert marks is not None and marks.there[0] > COUNT + brought
    desk.perform(mending.ForgetSource())
    assert desk.state.editing.source is None


def test_a_stroke_over_nothing_is_said_and_ends_its_job(desk: Desk) -> None:
    desk.perform(point.SetTool(Tool.CLONE), mending.PickSource((0.0, -50.0, 1.3)))
    desk.perform(mending.CloneStroke(Region(((340.0, 120.0),), 14.0)))
    with pytest.raises(InputError, match="choose another source"):
        desk.work()
