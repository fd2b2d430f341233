"""The parts of an answer: listed with how sure each is, taken out by a click, taken back; what is written
follows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from imgui_bundle import ImVec2, imgui

from app.window.asking import parting
from app.window.asking.commands import Answered, EditPrompt
from app.window.asking.panels import parts as panel
from app.window.asking.state import Part, Parts
from app.window.asking.work import ListParts
from app.window.editing import commands as edit
from app.window.kit import theme
from app.window.scene.commands import SceneArrived
from app.window.scene.mended import SplitPart
from app.window.scene.merging import Merged
from app.window.scene.work import WriteScene, describe_scene
from app.window.state import State
from langflash_core.geometry.poses import Vector
from langflash_core.scene.edited import edited_scene
from langflash_core.scene.file import load
from langflash_core.scene.mask import Mask
from langflash_core.segments import segment
from tests.app.window.headless import context, frames, look
from tests.app.window.scenes import after, told
from tests.boxroom import box_room

CUT = 0.85


@pytest.fixture(scope="module")
def shown() -> State:
    """Two chairs that share a group, and the phrase that finds both."""
    state = after(State(), SceneArrived(describe_scene(box_room(), 1, "room")), EditPrompt(0, "chair"))
    (prompt,) = state.asking.prompts
    return state.with_asking(prompts=(replace(prompt, calibrated=CUT, score=0.9),))


@pytest.fixture(scope="module")
def listed(shown: State) -> State:
    return after(shown, *work(shown))


@pytest.fixture(scope="module")
def less(listed: State) -> State:
    return taken_out(listed, parts(listed)[0])


def work(state: State) -> list:
    info, marks, prompt = state.scene.info, state.editing.marks, parting.divided(state)
    assert info is not None and marks is not None and prompt is not None
    return list(ListParts(info.serial, info.memory, marks, prompt.text, (), prompt.cut).run(lambda: False))


def parts(state: State) -> tuple[Part, ...]:
    assert state.asking.parts is not None
    return state.asking.parts.parts


def taken_out(state: State, part: Part) -> State:
    """As the effects do it."""
    info, marks = state.scene.info, state.editing.marks
    assert info is not None and marks is not None
    job = SplitPart(info, marks, part.rows, "chair")
    merged = job.run(info.serial + 1, lambda stage, share: None, lambda: False)
    assert merged.fits(state)
    return after(state, merged.arrival(state))


def chairs(state: State) -> int:
    info, marks = state.scene.info, state.editing.marks
    assert info is not None and marks is not None
    return segment(edited_scene(info.scene, marks), ["chair"], threshold=CUT).counts[0]


def test_a_part_is_a_thing_with_how_sure_it_is(listed: State) -> None:
    info = listed.scene.info
    assert info is not None
    first, second = parts(listed)
    assert {part.kind for part in (first, second)} == {"chair"} and first.share >= second.share
    assert all(CUT <= part.sure <= 1 for part in (first, second)) and not first.rows & second.rows
    both = segment(info.scene, ["chair"], threshold=CUT).members[0].numpy()
    assert ((first.rows | second.rows).rows() == both).all(), "all of the answer belongs to a part"
    means = info.scene.gaussians.means.numpy()
    for part in (first, second):
        own = means[part.rows.rows()]
        assert np.linalg.norm(own - np.array(part.place), axis=1).min() < 1e-6


def test_taking_a_part_out_leaves_the_others_and_all_that_is_written_follows(
    listed: State, less: State, tmp_path: Path
) -> None:
    assert (chairs(listed), chairs(less)) == (2, 1)
    history, info = less.editing.history, less.scene.info
    assert history is not None and info is not None and less.editing.unsaved
    assert history.done[-1].label == "Remove a part of chair"
    list(WriteScene(info.scene, tmp_path / "s.langflash", less.editing.marks).run(lambda: False))
    written = load(tmp_path / "s.langflash")
    assert segment(written, ["chair"], threshold=CUT).counts == (1,)
    assert len(written.gaussians) == len(box_room().gaussians), "the copies stand for what they replace"
    again = after(less, *work(less.with_asking(prompts=listed.asking.prompts)))
    again = again.with_asking(prompts=listed.asking.prompts)
    assert [part.kind for part in parts(after(again, *work(again)))] == ["chair"]


def test_it_can_be_undone_and_taken_back_and_out_again(less: State) -> None:
    assert chairs(after(less, edit.Undo())) == 2
    (atom,) = parting.taken_out(less, "chair")
    back = after(less, parting.TakePartBack("chair", atom))
    assert chairs(back) == 2 and parting.taken_out(back, "chair") == ()
    asked = back.with_asking(
        prompts=tuple(replace(p, calibrated=CUT, score=0.9) for p in back.asking.prompts)
    )
    own = next(p for p in parts(after(asked, *work(asked))) if parting.own_atom(asked, p) == atom)
    out = after(asked, parting.TakePartOut("chair", own))
    assert out.scene.job is None and chairs(out) == 1, (
        "it has an atom of its own by now: no other scene is made"
    )
    assert chairs(after(out, edit.Undo(), edit.Undo())) == 1 and chairs(after(out, *[edit.Undo()] * 3)) == 2


def test_a_click_in_the_picture_takes_the_part_that_is_there_and_brings_it_back(
    listed: State, less: State
) -> None:
    for part in parts(listed):
        command = parting.at_point(listed, part.place)
        assert command == parting.TakePartOut("chair", part)
    gone = parts(listed)[0]
    asked = less.with_asking(prompts=listed.asking.prompts, parts=Parts("chair", CUT, parts(listed)[1:]))
    asked = asked.with_asking(parts=None)
    (atom,) = parting.taken_out(less, "chair")
    assert parting.at_point(asked, gone.place) == parting.TakePartBack("chair", atom)
    assert parting.at_point(listed, (50.0, 0.0, 0.0)) is None


def test_what_has_no_parts_is_said_or_left_alone(listed: State) -> None:
    assert "Ask for something first" in told(after(State(), parting.TakePartAt((1.0, 1.0))))
    for text in ("chair - sofa", "chair +"):
        assert parting.divided(after(listed, EditPrompt(0, text))) is None
    other = after(listed, EditPrompt(0, "table"))
    stale = parting.PartsListed(Parts("chair", CUT, ()))
    assert after(other, stale).asking.parts == other.asking.parts
    moved = after(listed, edit.SelectAll(), edit.Delete())
    merged = Merged(1, (1, 1), listed.scene.info, "room", Mask.none(3), denied="chair")  # type: ignore[arg-type]
    assert not merged.fits(moved) and "Nothing was removed" in told(after(moved, merged))
    assert after(listed, Answered(())).asking.parts is not None


def test_every_part_has_a_row_that_fits_beside_the_picture(listed: State, monkeypatch) -> None:
    ends: list[float] = []
    real = imgui.button

    def button(label: str, *rest):
        given = real(label, *rest)
        ends.append(imgui.get_item_rect_max().x)
        return given

    many = tuple(Part("chest of drawers", 0.9, 0.1, Vector(0, 0, 1), Mask.none(1)) for _ in range(11))
    state = listed.with_asking(parts=Parts("chair", CUT, many))
    monkeypatch.setattr(imgui, "button", button)
    with context((800, 500)):
        theme.set_up(1.0, "dark")

        def draw(seen) -> None:
            imgui.set_next_window_pos(ImVec2(0, 0))
            imgui.set_next_window_size(ImVec2(348, 468))
            imgui.begin("##panel")
            panel.draw(state, seen)
            imgui.end()

        frames(draw, look(), count=1)
    assert len(ends) == panel.MOST and max(ends) <= 348
