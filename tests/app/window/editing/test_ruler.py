"""The ruler: lengths, and the scale that they give a scene."""

from pathlib import Path

import pytest

from app.window.editing import commands as edit
from app.window.editing import pointing as point
from app.window.editing.state import Reading, Tool
from app.window.filming import commands as film
from app.window.kit.lengths import said
from app.window.scene import commands as show
from app.window.scene.work import WriteScene, describe_scene
from app.window.state import State
from langflash_core.scene.file import load
from tests.app.window.scenes import after, shown_scene


def measured() -> State:
    ends = (Reading((1.0, 1.0), (0.0, 0.0, 1.0)), Reading((9.0, 1.0), (0.3, 0.4, 1.0)))
    placed = (point.RulerPlaced(end) for end in ends)
    return after(shown_scene(), point.SetTool(Tool.RULER), *placed)


def test_a_length_gives_the_scene_a_scale() -> None:
    state = measured()
    assert point.measured(state.editing.ruler) == pytest.approx(0.5)
    scaled = after(state, point.SetLength(0.76))
    assert scaled.metric == pytest.approx(1.52)
    for wrong in (0.0, -1.0, 1e9, float("nan")):
        assert after(state, point.SetLength(wrong)).metric == state.metric
    assert after(shown_scene(), point.SetLength(1.0)).metric is None, "nothing is measured"


def test_a_third_click_begins_anew_and_nothing_is_no_end() -> None:
    state = after(measured(), point.RulerPlaced(Reading((3.0, 3.0))))
    assert len(state.editing.ruler) == 2
    state = after(state, point.RulerPlaced(Reading((3.0, 3.0), (0.0, 0.0, 2.0))))
    assert state.editing.ruler == ((0.0, 0.0, 2.0),)
    assert after(state, point.ClearRuler()).editing.ruler == ()
    assert after(state, point.SetTool(Tool.MOVE)).editing.ruler == ()


def test_a_scale_is_an_edit_that_is_unsaved_and_undone() -> None:
    state = after(measured(), point.SetLength(0.76))
    assert state.editing.unsaved and not measured().editing.unsaved
    other = after(state, point.SetLength(0.5))
    assert after(other, edit.Undo()).metric == state.metric
    back = after(other, edit.Undo(), edit.Undo())
    assert back.metric is None and not back.editing.unsaved
    assert after(back, edit.Redo()).metric == state.metric


def test_lengths_are_told_in_metres_where_there_is_a_scale() -> None:
    assert said(0.5, None) == "0.500 units"
    assert said(0.5, 1.52) == "76.0 cm" and said(2.0, 1.52) == "3.04 m"


def test_the_scale_is_saved_and_comes_back(tmp_path: Path) -> None:
    state = after(measured(), point.SetLength(0.76), film.AddKey())
    assert state.scene.info is not None
    path = tmp_path / "room.langflash"
    list(WriteScene(state.scene.info.scene, path, state.editing.marks).run(lambda: False))
    again = describe_scene(load(path), 7, "room")
    back = after(State(), show.SceneArrived(again))
    assert back.metric == pytest.approx(1.52) and back.keys == (state.scene.pose,)
