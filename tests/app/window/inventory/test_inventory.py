"""The inventory in the window: the core's list, named, chosen and flown to; at both sizes, and looked for
again when what it is of is another."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from imgui_bundle import ImVec2

from app.window import commands as do
from app.window.editing import commands as edit
from app.window.effects import Hands
from app.window.exporting import commands as export
from app.window.inventory import commands as take
from app.window.inventory import panel
from app.window.inventory.effects import InventoryEffects
from app.window.inventory.work import TakeInventory, small_picture
from app.window.kit import theme
from app.window.kit.boxes import overlap
from app.window.scene.commands import SceneArrived
from app.window.scene.standing import Levelled
from app.window.scene.state import FLIGHT_SECONDS
from app.window.scene.work import WriteScene, describe_scene
from app.window.state import State
from langflash_core.base import outputs
from langflash_core.geometry import poses
from langflash_core.geometry.rotations import turn_of
from langflash_core.inventory import inventory
from langflash_core.level import found_world
from langflash_core.scene.edited import edited_scene
from langflash_core.scene.file import load
from langflash_core.scene.mask import Mask
from langflash_core.types import Scene
from tests.app.window.headless import box, context, frames, look
from tests.app.window.scenes import after
from tests.boxroom import METRES, box_room, without_language


@pytest.fixture(scope="module")
def room() -> Scene:
    plain = box_room()
    return plain.with_record(world=found_world(plain), metric_scale=METRES)


@pytest.fixture(scope="module")
def shown(room: Scene) -> State:
    return after(State(), SceneArrived(describe_scene(room, 1, "room")), take.ShowInventory(True))


@pytest.fixture(scope="module")
def listed(shown: State) -> State:
    return after(shown, *work(shown))


def work(state: State) -> list[do.Command]:
    info, marks = state.scene.info, state.editing.marks
    assert info is not None and marks is not None
    return list(TakeInventory(info.serial, info.memory, marks).run(never))


def never() -> bool:
    return False


def test_the_list_is_the_librarys(listed: State, room: Scene) -> None:
    found = inventory(room)
    assert listed.listing.counts == found.counts and listed.listing.unit == "m"
    rows, world = listed.listing.rows, room.record.world
    assert world is not None
    assert rows is not None and len(rows) == len(found.things)
    for row, thing in zip(rows, found.things, strict=True):
        assert (row.id, row.sure, row.size, row.photos) == (thing.id, thing.sure, thing.size, thing.photos)
        assert (row.rows.rows() == thing.rows).all()
        stands = (row.corners - world.origin) @ turn_of(world).T * METRES
        np.testing.assert_allclose(stands[:4, [0, 2]], thing.corners, atol=1e-9)
        np.testing.assert_allclose(
            -stands[[0, 4], 1], [thing.bottom, thing.bottom + thing.size[2]], atol=1e-9
        )


def test_what_was_deleted_is_in_it_no_more_and_rows_are_those_of_the_whole_scene(listed: State) -> None:
    chair = listed.listing.row("chair 1")
    assert chair is not None
    gone = after(listed, take.ChooseThing("chair 1"), edit.Delete())
    again = after(gone, *work(gone))
    assert again.listing.counts == {"chair": 1, "door": 1, "table": 1}
    before, now = listed.listing.row("table 1"), again.listing.row("table 1")
    assert before is not None and now is not None and now.rows == before.rows
    assert again.listing.chosen == "chair 1", "another one has that name by now"


def test_names_are_edits_that_are_saved_exported_and_undone(listed: State, tmp_path: Path) -> None:
    named = after(listed, take.NameThing("chair 2", "  reading   chair "))
    marks = named.editing.marks
    assert marks is not None and marks.thing_names == {"chair 2": "reading chair"}
    assert named.editing.unsaved and named.editing.exported_anew
    info = named.scene.info
    assert info is not None
    titles = [thing.title for thing in inventory(edited_scene(info.scene, marks)).things]
    assert "reading chair" in titles
    list(WriteScene(info.scene, tmp_path / "s.langflash", marks).run(never))
    assert load(tmp_path / "s.langflash").record.thing_names == {"chair 2": "reading chair"}
    assert not after(named, edit.Undo()).editing.unsaved
    back = after(named, take.NameThing("chair 2", "")).editing.marks
    assert back is not None and back.thing_names == {}
    assert after(listed, take.NameThing("chair 2", "chair 2")).editing.marks == listed.editing.marks


def test_the_name_at_a_box_leaves_the_bars() -> None:
    """At 800 x 500 the bar of the selection, which a click on a row brings, stood before half of it."""
    bar = (418.0, 64.0, 778.0, 170.0)
    seen = []
    with context((800, 500)):
        theme.set_up(1.0, "dark")
        frames(lambda at: seen.append(panel.caption_box(at, (573.0, 184.0), "yucca", (bar,))), look(), 1)
    assert not overlap(seen[0], bar) and seen[0][1] < 184


def test_a_click_selects_a_thing_and_flies_to_where_it_is_seen(listed: State) -> None:
    size = (600.0, 450.0)
    state = after(listed, take.ChooseThing("table 1", picture=(*size, 200.0)))
    row = state.listing.row("table 1")
    assert row is not None and state.editing.marks is not None and state.editing.marks.selected == row.rows
    landed = after(state, do.Tick(state.now + FLIGHT_SECONDS + 1))
    found = poses.project(row.corners, landed.scene.pose, size)
    assert found is not None, "all of it is in front"
    middle = found[1].mean(0)
    assert 100 < middle[0] < 300 and 100 < middle[1] < 350, "in what the panel leaves of the picture"
    assert (found[1] > 0).all() and (found[1][:, 0] < 420).all()
    more = after(landed, take.ChooseThing("chair 1", "add"))
    assert more.editing.num_selected > state.editing.num_selected
    assert after(more, edit.Undo(), edit.Undo()).editing.num_selected == 0
    assert after(listed, take.ChooseThing("ghost 1")) == listed


@pytest.mark.parametrize("thing", ["table 1", "chair 1", "chair 2", "door 1"])
@pytest.mark.parametrize("covered", [200.0, 300.0])
def test_a_panel_beside_it_makes_a_thing_no_smaller_than_it_must(
    listed: State, thing: str, covered: float
) -> None:
    """One flew to a plant, and it was smaller than in the photo."""

    def seen(covered: float) -> np.ndarray:
        state = after(listed, take.ChooseThing(thing, picture=(600.0, 450.0, covered)))
        row, landed = state.listing.row(thing), after(state, do.Tick(state.now + FLIGHT_SECONDS + 1))
        assert row is not None
        found = poses.project(row.corners, landed.scene.pose, (600.0, 450.0))
        assert found is not None
        return found[1]

    alone, beside = seen(0.0), seen(covered)
    assert beside[:, 0].min() >= 0 and beside[:, 0].max() <= 600 - covered
    assert np.ptp(alone[:, 0]) * take.AROUND <= 600 - covered, "it has room there"
    assert np.ptp(beside[:, 1]) == pytest.approx(np.ptp(alone[:, 1]), abs=1.0)  # moved aside alone


def test_a_thing_that_no_photo_shows_is_flown_to_as_one_stands(listed: State) -> None:
    row = listed.listing.row("table 1")
    assert row is not None
    there = take.seen_best(listed, replace(row, photos=()))
    np.testing.assert_allclose(there.axes[:, 2], listed.scene.pose.axes[:, 2], atol=1e-6)


def test_without_language_it_says_why(room: Scene) -> None:
    mute = without_language(room)
    shown = after(State(), SceneArrived(describe_scene(mute, 1, "mute")), take.ShowInventory(True))
    info, marks = shown.scene.info, shown.editing.marks
    assert info is not None and marks is not None
    task = TakeInventory(1, info.memory, marks)
    told = after(shown, *task.failed("the scene has no language"))
    assert told.listing.rows == () and "no language" in told.listing.problem
    assert after(told, SceneArrived(describe_scene(room, 2, "room"))).listing.rows is None


def test_it_is_looked_for_once_and_again_a_moment_after_what_changes_it(shown: State) -> None:
    asked: list[TakeInventory] = []
    clock = [0.0]
    hands = Hands(lambda command: None, lambda command: None, asked.append, lambda: None, lambda: clock[0])  # type: ignore[arg-type]
    effects = InventoryEffects(hands)

    def pass_time(state: State, seconds: float = 2.0) -> int:
        before = len(asked)
        for _ in range(4):
            clock[0] += seconds / 4
            effects.tick(state, clock[0])
        return len(asked) - before

    def do_it(state: State, command: do.Command) -> State:
        new = after(state, command)
        effects.follow(command, state, new)
        return new

    closed = after(shown, take.ShowInventory(False))
    state = do_it(closed, take.ShowInventory(True))
    assert pass_time(state) == 1
    state = after(state, *work(state))
    state = do_it(state, take.NameThing("chair 1", "mine"))
    assert pass_time(state) == 0, "a name changes no thing"
    marks = state.editing.marks
    assert marks is not None
    state = do_it(state, edit.Found(Mask.first(marks.deleted.count, 40), "replace", "here"))
    assert pass_time(state) == 0, "nor does a selection"
    state = do_it(state, edit.Delete())
    assert pass_time(state, 0.1) == 0 and pass_time(state) == 1
    world = replace(found_world(box_room()), origin=(0.0, 1.0, 0.0))
    state = do_it(state, Levelled(world))
    state = do_it(state, take.ShowInventory(False))
    assert pass_time(state) == 0, "nobody looks at it"
    assert pass_time(do_it(state, take.ShowInventory(True))) == 1


def test_its_files_are_offered_by_the_export_dialog_and_by_that_alone(shown: State) -> None:
    state = after(shown, export.ShowExport(outputs.INVENTORY_CSV))
    assert state.exporting.form.what is outputs.INVENTORY_CSV
    assert state.exporting.form.path.endswith("_inventory.csv")
    other = after(state, do.ShowDialog(None), export.ShowExport(outputs.PLAN_DXF))
    assert other.exporting.form.path.endswith("_plan.dxf")
    usual = after(other, do.ShowDialog(None), export.ShowExport())
    assert usual.exporting.form.what is outputs.RGB
    assert not set(outputs.ROOM) & set(outputs.OFFERED) and len(outputs.ROOM) == 5


@pytest.mark.parametrize(("window", "scale"), [((1280, 800), 1.0), ((800, 500), 1.0), ((1280, 800), 1.5)])
def test_the_panel_stays_in_the_window_and_leaves_the_picture_to_see(
    listed: State, window: tuple[int, int], scale: float
) -> None:
    left, top = 348 * scale, 52 * scale
    place, size = ImVec2(left, top), ImVec2(window[0] - left, window[1] - top - 32 * scale)
    above = ImVec2(size.x, size.y - 88 * scale)  # where there is a strip of photos
    with context(window):
        theme.set_up(scale, "dark")
        frames(lambda seen: panel.draw(listed, seen, place, size, above), look(scale))
        x0, y0, x1, y1 = box("Inventory")
    assert x0 < left or y1 <= top + above.y, "it covers the buttons beside the photos"
    assert x0 >= 0 and y0 >= 0 and x1 <= window[0] + 1 and y1 <= window[1] + 1
    covered = max(0.0, min(x1, left + size.x) - max(x0, left))
    assert covered <= 0.65 * size.x


def test_words_of_a_row(listed: State) -> None:
    row = listed.listing.row("table 1")
    assert row is not None
    size, where = panel.words(replace(row, place=(-0.61, 0.0, 1.24), photos=(2, 0), cut=True), "m")
    assert size.endswith(" m and more") and where == "0.6 m W, 1.2 m N · photos 1, 3"
    assert panel.words(replace(row, photos=(), place=(1.0, 0.0, -2.0)), "units")[1] == "1.0 u E, 2.0 u S"


def test_a_damaged_photo_shows_nothing_and_stops_nothing(room: Scene) -> None:
    broken = replace(room, photos=(b"no photo",) * room.num_views)
    means = room.gaussians.means[:50].numpy()
    assert small_picture(broken, means, (0,)) is None and small_picture(broken, means, ()) is None
    behind = torch.tensor([[0.0, 0.0, -1.0]]).numpy()
    assert small_picture(room, behind, (0,)) is None
