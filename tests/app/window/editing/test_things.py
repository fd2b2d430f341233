"""Things by a click: less and more of one is one edit, what is selected has a line, and what filling takes
beyond it is said."""

from dataclasses import replace

import numpy as np
import pytest

from app.window.editing import commands as edit
from app.window.editing import mending, work
from app.window.editing import pointing as point
from app.window.editing.effects import EditingEffects
from app.window.editing.panels.tools import waits
from app.window.editing.state import Tool
from app.window.editing.things import Outlined, SetLevel, StepLevel, ThingFound
from app.window.frame import table
from app.window.scene import commands as show
from app.window.scene.merging import Merged
from app.window.state import State
from langflash_core.scene.mask import Mask
from tests.app.window.desk import Bare
from tests.app.window.editing.test_mending import BLOCK, Desk, desk
from tests.app.window.scenes import after, labels

__all__ = ["desk"]  # a fixture
LEVELS = tuple(Mask.first(12_300, count) for count in (100, BLOCK, 5000))


@pytest.fixture
def clicked(info) -> State:
    """A click found three levels, the second of them a thing."""
    state = after(State(), show.SceneArrived(info), point.SetTool(Tool.PICK))
    return after(state, edit.SelectThing((1.0, 2.0)), ThingFound(LEVELS, 1, "replace"))


def test_a_click_is_one_edit_however_its_level_is_moved(clicked: State) -> None:
    assert clicked.editing.num_selected == BLOCK and not clicked.editing.waiting
    assert labels(clicked) == ["Select 2,500 of a thing"]
    more = after(clicked, StepLevel(1))
    assert more.editing.num_selected == 5000 and labels(more) == ["Select 5,000 of a thing"]
    less = after(more, SetLevel(0))
    assert less.editing.num_selected == 100 and len(labels(less)) == 1
    assert after(less, StepLevel(-1)) == less and after(more, StepLevel(5)) == more, "there is no other"
    assert after(less, edit.Undo()).editing.num_selected == 0


def test_shift_adds_a_thing_and_levels_are_those_of_the_last_one(clicked: State) -> None:
    other = Mask.of(np.arange(12_300) >= 12_000)
    both = after(clicked, ThingFound((other - Mask.first(12_300, 12_200), other), 0, "add"))
    assert both.editing.num_selected == BLOCK + 100
    more = after(both, StepLevel(1))
    assert more.editing.num_selected == BLOCK + 300 and labels(more)[-1] == "Add 300 of a thing"
    assert len(labels(more)) == 2 and after(more, edit.Undo()).editing.num_selected == BLOCK


def test_after_another_edit_there_are_no_levels(clicked: State) -> None:
    grown = after(clicked, edit.Invert())
    assert clicked.editing.reached is not None and grown.editing.reached is None
    assert after(grown, StepLevel(1), SetLevel(0)) == grown
    back = after(clicked, edit.Undo())
    assert back.editing.reached is None and after(back, StepLevel(1)) == back


def test_a_level_of_another_scene_selects_nothing(info) -> None:
    state = after(State(), show.SceneArrived(info))
    assert after(state, ThingFound((Mask.first(7, 3),), 0, "replace")).editing.num_selected == 0
    assert after(State(), ThingFound(LEVELS, 1, "replace")).editing.history is None


def test_brackets_take_less_and_more_of_a_thing_or_size_the_brush(clicked: State) -> None:
    less = table.named("A smaller brush, or less of a thing")
    more = table.named("A larger brush, or more of a thing")
    assert (less.make(clicked), more.make(clicked)) == (StepLevel(-1), StepLevel(1))
    brush = after(clicked, point.SetTool(Tool.BRUSH))
    made = more.make(brush)
    assert isinstance(made, point.SetRadius) and made.radius > brush.editing.radius


class _Place:
    """A picture's place that shows what the state says."""

    size, drawn, pose = (448, 336), 0, None

    def mark(self, *_) -> None:
        """Nothing to show it on."""


def test_a_line_is_asked_for_once_the_selection_and_the_place_rest(clicked: State) -> None:
    desk = Bare(clicked)
    asked: list = desk.asked
    effects = EditingEffects(desk.hands, _Place())  # type: ignore[arg-type]
    effects.after_picture(clicked)
    assert not asked, "it may move on"
    for _ in range(3):
        effects.after_picture(clicked)
    assert [type(each) for each in asked] == [work.DrawOutline]
    moved = clicked.with_scene(pose=replace(clicked.scene.pose, reach=1.5))
    for _ in range(3):
        effects.after_picture(moved)
    assert len(asked) == 2
    (found,) = asked[0].run(lambda: False)
    assert isinstance(found, Outlined) and found.outline.lines and clicked.editing.marks is not None
    assert found.outline.of == clicked.editing.marks.selected
    assert after(clicked, found).editing.outline == found.outline
    points = np.array([at for line in found.outline.lines for at in line])
    assert (points >= 0).all() and (points <= _Place.size).all()


def test_things_are_prepared_once_the_tool_is_taken(clicked: State) -> None:
    desk, taken = Bare(clicked), point.SetTool(Tool.PICK)
    effects = EditingEffects(desk.hands, _Place())  # type: ignore[arg-type]
    assert after(clicked, edit.SelectThing((5.0, 5.0))).editing.waiting == "Finding things"
    effects.follow(taken, clicked, after(clicked, taken))
    (prepares,) = desk.asked
    assert isinstance(prepares, work.PrepareThings)
    waiting, told = after(clicked, edit.SelectThing((5.0, 5.0))), []
    for command in prepares.run(lambda: False):
        waiting = after(waiting, command)
        told.append((waiting.editing.searched, waits(waiting.editing)))
    shares = [share for share, _ in told]
    assert shares == sorted(shares) and shares[0] < 1 == shares[-1] and len(shares) > 2
    assert told[0][1] == f"Finding things, once per scene: {shares[0]:.0%}"
    assert told[-1][1] == "Finding things ..."
    assert list(work.regions_in(prepares.memory)) == [], "it is kept"


def test_what_filling_takes_beyond_the_selection_and_what_no_photo_saw_is_said(desk: Desk) -> None:
    desk.perform(mending.FillSelection())
    desk.work()
    beyond = desk.state.editing.num_deleted - BLOCK
    assert 0 <= beyond < BLOCK / 20  # the block stands free, and has no layers
    told = [each.text for each in desk.state.toasts]
    assert any("what was behind it, so what is around goes on there." in text for text in told), told
    info = desk.state.scene.info
    assert info is not None
    filled = Merged(1, (9, 9), info, "a room", Mask.first(9, 5), beyond=2)
    why = "along its edge, or in its place in other photos,"
    assert filled.said == f"2 Gaussians {why} went with the 3 selected."
    half = replace(filled, beyond=0, unseen=0.5)
    assert half.said == "No photo shows 50% of what was behind it, so what is around goes on there."
    assert not replace(filled, beyond=0, unseen=0.01).said
