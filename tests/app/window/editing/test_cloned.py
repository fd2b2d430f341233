"""What the clone brush laid is in every file that the window makes of the scene, and comes back from it."""

from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from torch import Tensor

from app.window.editing import commands as edit
from app.window.editing import mending
from app.window.editing import pointing as point
from app.window.editing.state import Region, Tool
from app.window.recovery import edits
from app.window.recovery.work import KeepCopy
from app.window.scene import commands as show
from app.window.scene.work import LoadScene
from langflash_core.export.ply import read_ply, write_ply
from langflash_core.export.splat import read_splat, write_splat
from langflash_core.scene.edited import edited_scene
from langflash_core.scene.file import load
from langflash_core.types import Gaussians, Scene
from tests.app.window.editing.test_mending import COUNT, Desk, desk

__all__ = ["desk"]  # a fixture

FIELDS = ("means", "quats", "scales", "opacities", "sh")


@pytest.fixture
def cloned(desk: Desk) -> Desk:
    """Two strokes of the brush, the second taken back and made again."""
    desk.perform(point.SetTool(Tool.CLONE), mending.PickSource((-0.15, 0.1, 0.65)))
    for serial, at in enumerate(((340.0, 120.0), (380.0, 60.0)), 7):
        desk.perform(mending.CloneStroke(Region((at, (at[0] + 12, at[1] + 6)), 14.0)))
        desk.work(serial)
    desk.perform(edit.Undo(), edit.Redo())
    marks = desk.state.editing.marks
    assert marks is not None and marks.there[0] > COUNT + 100 and len(marks.deleted) > 10
    return desk


def on_show(desk: Desk) -> Scene:
    info, marks = desk.state.scene.info, desk.state.editing.marks
    assert info is not None and marks is not None
    return edited_scene(info.scene, marks)


def same(found: Gaussians, shown: Gaussians) -> None:
    for name in FIELDS:
        assert torch.equal(getattr(found, name), getattr(shown, name)), name


def test_a_saved_scene_and_the_copy_that_exports_read_hold_the_clones(cloned: Desk, tmp_path: Path) -> None:
    shown, info, marks = on_show(cloned), cloned.state.scene.info, cloned.state.editing.marks
    assert info is not None and marks is not None
    brought = marks.there[0] - COUNT
    assert len(shown.gaussians) == COUNT + brought - len(marks.deleted)
    copy, saved = cloned.keeper.edited_file, tmp_path / "saved.langflash"
    cloned.asked.append(KeepCopy(info.serial, info.scene, copy, marks))
    cloned.perform(show.SaveScene(saved))
    cloned.work(9)
    for path in (copy, saved):
        found = load(path)
        same(found.gaussians, shown.gaussians)
        assert torch.equal(found.semantics.weight_ids, shown.semantics.weight_ids)


@pytest.mark.parametrize(
    ("ending", "write", "read", "off"),
    [
        ("ply", write_ply, read_ply, 1e-5),  # its logarithms and logits are of float32
        ("splat", write_splat, read_splat, 1 / 127),  # its colours and turns have 8 bits
    ],
)
def test_exports_hold_the_clones(
    cloned: Desk, tmp_path: Path, ending: str, write: Callable, read: Callable, off: float
) -> None:
    shown, path = on_show(cloned), tmp_path / f"cloned.{ending}"
    write(shown, path)
    found: Gaussians = read(path).gaussians
    order = in_order(shown.gaussians.means, found.means)
    assert torch.equal(found.means[order], shown.gaussians.means)
    for name in ("scales", "opacities"):
        assert torch.allclose(getattr(found, name)[order], getattr(shown.gaussians, name), rtol=off, atol=off)
    marks = cloned.state.editing.marks
    assert marks is not None
    laid = shown.gaussians.means[-(marks.there[0] - COUNT) :]
    assert float((laid[:, 2] - 1.3).abs().max()) < 1e-3, "on the wall, which is what was brushed"


def in_order(wanted: Tensor, found: Tensor) -> Tensor:
    """Rows of `found` in the order of `wanted`: some formats put the largest first."""
    assert len(wanted) == len(found)
    places = {row: number for number, row in enumerate(map(tuple, found.tolist()))}
    assert len(places) == len(found), "no two are at one place"
    return torch.tensor([places[row] for row in map(tuple, wanted.tolist())])


def test_clones_come_back_after_a_crash_with_every_stroke_to_undo(cloned: Desk) -> None:
    cloned.rest()  # kept by itself, and then nothing more is heard of the window
    shown, before = on_show(cloned), cloned.state.editing.history
    offer = edits.find()
    assert offer is not None and before is not None and offer.count == len(before.done)
    arrived = LoadScene(offer.edits.with_suffix(".langflash"), offer.edits).run(
        9, lambda *_: None, lambda: False
    )
    again = Desk()
    again.perform(arrived)
    same(on_show(again).gaussians, shown.gaussians)
    after = again.state.editing.history
    assert after is not None and after.marks == before.marks
    assert [each.label for each in after.done] == [each.label for each in before.done]
    again.perform(edit.Undo())
    cloned.perform(edit.Undo())
    same(on_show(again).gaussians, on_show(cloned).gaussians)
    assert len(on_show(again).gaussians) < len(shown.gaussians)
    again.perform(edit.Undo())
    assert len(on_show(again).gaussians) == COUNT
    again.effects.close(again.state, crashed=False)
