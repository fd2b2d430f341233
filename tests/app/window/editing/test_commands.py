"""Editing commands as pure changes of a frozen state, without a window."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.window import commands as do
from app.window.asking import commands as ask
from app.window.asking.state import BINS, Histogram
from app.window.editing import commands as edit
from app.window.editing import pointing as point
from app.window.editing.state import RADIUS_RANGE, Floaters, Reading, Region, Tool
from app.window.frame.status import figures
from app.window.scene import commands as show
from app.window.scene.state import FLIGHT_SECONDS, Job
from app.window.state import State
from langflash_core.base import pictures
from langflash_core.scene.edited import edited_scene
from langflash_core.scene.edits import Combine, Mask
from tests.app.window.scenes import CHAIR, after, labels

CHAIRS = 2500  # the first rows of the room are its block


def rows(first: int, last: int, count: int = 12_300) -> Mask:
    inside = np.zeros(count, bool)
    inside[first:last] = True
    return Mask.of(inside)


def found(first: int, last: int, combine: Combine = "replace") -> edit.Found:
    return edit.Found(rows(first, last), combine, "in a box")


def selected(state: State) -> Mask:
    assert state.editing.marks is not None
    return state.editing.marks.selected


def test_selections_are_entries_with_plain_names(shown: State) -> None:
    state = after(shown, found(0, 1500), found(1000, 2000, "add"), found(0, 100, "remove"))
    assert labels(state) == ["Select 1,500 in a box", "Add 500 in a box", "Unselect 100 in a box"]
    assert selected(state) == rows(100, 2000)
    assert after(state, found(0, 100, "remove")) == state  # nothing changes: no entry
    state = after(state, edit.Invert(), found(0, 0), edit.Deselect(), edit.SelectAll())
    assert labels(state)[3:] == [
        "Invert the selection",
        "Deselect",
        "Select all",
    ]  # a click beside all things
    assert len(selected(state)) == 12_300


def test_deleting_hiding_and_isolating(shown: State) -> None:
    state = after(shown, found(0, 10), edit.Delete(), found(0, 30), edit.Hide())
    assert labels(state)[1:] == ["Delete 10", "Select 20 in a box", "Hide 20"]
    marks = state.editing.marks
    assert marks is not None and (len(marks.deleted), len(marks.hidden), len(marks.selected)) == (10, 20, 0)
    state = after(state, edit.ShowAll(), found(100, 150), edit.Isolate())
    assert len(state.editing.marks.visible) == 50 and state.editing.num_selected == 50  # type: ignore[union-attr]
    assert after(state, edit.Deselect(), edit.Delete()).editing.marks.deleted == marks.deleted  # type: ignore[union-attr]


def test_undo_redo_and_going_to_an_entry(shown: State, info) -> None:
    state = after(shown, found(0, 10), edit.Delete(), edit.SelectAll())
    back = after(state, edit.Undo(), edit.Undo(), edit.Undo(), edit.Undo())
    assert back.editing.marks == shown.editing.marks
    assert edited_scene(info.scene, back.editing.marks) is info.scene  # type: ignore[arg-type]
    assert after(back, *[edit.Redo()] * 4).editing.history == state.editing.history
    assert after(back, edit.GoTo(2)).editing.history == after(state, edit.GoTo(2)).editing.history


def test_random_commands_undone_give_the_first_state(shown: State) -> None:
    generator = np.random.default_rng(7)
    state = shown
    while len(labels(state)) < 200:
        first = int(generator.integers(12_000))
        combine = ("replace", "add", "remove")[generator.integers(3)]
        choices = (
            found(first, first + int(generator.integers(1, 3000)), combine), edit.Invert(), edit.SelectAll(),
            edit.Deselect(), edit.Delete(), edit.Hide(), edit.Isolate(), edit.ShowAll(), edit.Undo(),
            edit.Redo(), edit.RenameAtom(int(generator.integers(3)), f"thing {first % 5}"),
            edit.ToggleAtom(int(generator.integers(3))), edit.MergeAtoms((first % 3, (first + 1) % 3)),
        )  # fmt: skip
        # Deleting everything early would leave nothing to edit.
        command = choices[generator.integers(len(choices))]
        if isinstance(command, edit.Delete) and state.editing.num_selected > 500:
            continue
        state = after(state, command)
    assert state.editing.marks != shown.editing.marks
    back = after(state, *[edit.Undo()] * len(labels(state)))
    assert back.editing.marks == shown.editing.marks and labels(back) == []


def test_unsaved_is_what_a_file_would_miss(shown: State) -> None:
    assert not shown.editing.dirty and not shown.editing.unsaved
    state = after(shown, found(0, 10))
    assert state.editing.dirty and not state.editing.unsaved
    state = after(state, edit.Delete())
    assert state.editing.unsaved
    saved = after(state, show.SceneSaved(Path("s.langflash"), state.editing.marks))
    assert not saved.editing.dirty
    assert after(saved, edit.Undo()).editing.unsaved


def test_a_new_scene_starts_a_new_history_with_the_same_tool(shown: State, info) -> None:
    state = after(shown, point.SetTool(Tool.BRUSH), point.SetRadius(60), found(0, 10), edit.Delete())
    state = after(state, show.SceneArrived(replace(info, serial=2)))
    assert labels(state) == [] and state.editing.tool is Tool.BRUSH and state.editing.radius == 60
    late = after(state, edit.Found(rows(0, 3, 77), "replace", "late"))
    assert labels(late) == []  # of a scene that is gone


def test_settings_stay_within_their_ranges(shown: State) -> None:
    state = after(shown, point.SetRadius(1e9), point.SetReach(-3))
    assert state.editing.radius == RADIUS_RANGE[1] and state.editing.reach == 1.0


def test_floaters_are_previewed_then_deleted(shown: State) -> None:
    least = np.full(12_300, np.inf, np.float32)
    least[:5], least[5:9] = 0.2, 0.6
    state = after(shown, edit.FindFloaters(), edit.FloatersFound(least.tobytes()), edit.SetStrength(0.4))
    assert state.editing.floaters is not None and state.editing.marks == shown.editing.marks
    assert len(state.editing.floaters.mask(state.editing.marks.visible)) == 5  # type: ignore[union-attr]
    with pytest.MonkeyPatch.context() as later:  # frames that follow do not look at every Gaussian again
        later.setattr(np, "packbits", None)
        assert len(state.editing.floaters.mask(state.editing.marks.visible)) == 5  # type: ignore[union-attr]
    gone = after(state, edit.EndFloaters("delete"))
    assert labels(gone) == ["Delete 5 floaters"] and gone.editing.floaters is None
    chosen = after(state, edit.SetStrength(0.7), edit.EndFloaters("select"))
    assert labels(chosen) == ["Select 9 floaters"]
    assert labels(after(state, edit.EndFloaters())) == []
    assert after(shown, edit.FindFloaters(), edit.FloatersFound(b"1234")).editing.floaters == Floaters()


def test_a_click_is_answered_and_becomes_a_prompt(shown: State) -> None:
    reading = Reading((5.0, 6.0), (0.1, 0.2, 0.9), 0.9)
    state = after(shown, point.SetTool(Tool.POINT), point.Ask((5.0, 6.0)), point.CardOpened(reading))
    stale = point.Named(Reading((1.0, 1.0)), Reading((1.0, 1.0)), (("door", 0.9),), b"x")
    assert after(state, stale) == state
    weighed = replace(reading, atoms=((0, 1.0),))
    vector = np.arange(3, dtype=np.float32).tobytes()
    state = after(state, point.Named(reading, weighed, (("armchair", 0.9), ("sofa", 0.7)), vector))
    assert state.editing.card is not None and state.editing.card.reading.atoms == ((0, 1.0),)
    similar = after(state, point.FindSimilar())
    prompt = similar.asking.prompts[-1]
    assert (len(similar.asking.prompts), prompt.text, prompt.like) == (1, "like this (armchair)", vector)
    assert (
        similar.scene.mode is pictures.HEAT
        and similar.asking.active == prompt.key
        and similar.editing.card is None
    )
    typed = after(similar, ask.EditPrompt(prompt.key, "sofa"))
    assert typed.asking.prompts[0].like == b""
    again = after(replace(similar, editing=state.editing), point.FindSimilar())
    assert len(again.asking.prompts) == 2 and again.asking.prompts[0].colour != again.asking.prompts[1].colour


def test_what_the_pointer_left_is_forgotten(shown: State) -> None:
    state = after(shown, point.Hover((3.0, 4.0)), point.ReadingTaken(Reading((3.0, 4.0), (0, 0, 1), 1.0)))
    assert state.editing.hover is not None and state.editing.hover.depth == 1.0
    moved = after(state, point.Hover((9.0, 9.0)), point.ReadingTaken(Reading((3.0, 4.0), (0, 0, 1), 1.0)))
    assert moved.editing.hover == Reading((9.0, 9.0))
    assert after(moved, point.Hover(None)).editing.hover is None


def test_atoms_are_named_by_the_person_or_by_words(shown: State) -> None:
    state = after(shown, point.AtomsNamed((("armchair", "sofa"), ("wall",), ())))
    assert [state.editing.atom_name(k) for k in range(3)] == ["armchair", "wall", "group 2"]
    state = after(state, edit.RenameAtom(0, "my chair"), edit.RenameAtom(9, "none"))
    assert state.editing.atom_name(0) == "my chair" and labels(state) == ["Name group 0 'my chair'"]
    assert after(state, edit.Undo()).editing.atom_name(0) == "armchair"


def test_names_and_denials_make_scores_lapse_and_can_be_undone(shown: State) -> None:
    scored = after(shown, ask.EditPrompt(0, "wall"), ask.Answered(((0, "wall", 0.9),)))
    for lesson in (edit.RenameAtom(0, "wall"), edit.DenyAtom(0, "wall")):
        taught = after(scored, lesson)
        assert taught.asking.prompts[0].score is None and taught.asking.revision > scored.asking.revision
        assert after(taught, edit.Undo()).editing.marks == shown.editing.marks
    assert after(scored, edit.DenyAtom(9, "wall"), edit.DenyAtom(0, " ")).editing == scored.editing


def test_framing_the_selection_flies_to_it(shown: State) -> None:
    state = after(shown, found(0, CHAIRS), point.FrameSelection(), do.Tick(shown.now + FLIGHT_SECONDS))
    # Its front is a square of 0.4 around (x, y), at the block's z - 0.2.
    assert state.scene.pose.pivot == pytest.approx((CHAIR[0], CHAIR[1], CHAIR[2] - 0.2), abs=0.01)
    assert state.scene.pose.reach < shown.scene.pose.reach * 2 and state.scene.view is None


def test_commands_without_a_scene_do_nothing() -> None:
    every = (
        found(0, 1), edit.SelectAll(), edit.Deselect(), edit.Invert(), edit.Delete(), edit.Hide(),
        edit.Isolate(), edit.ShowAll(), edit.Undo(), edit.Redo(), edit.GoTo(3), edit.FindFloaters(),
        edit.EndFloaters("delete"), edit.RenameAtom(0, "x"), edit.MergeAtoms((0, 1)), edit.ToggleAtom(0),
        point.FindSimilar(), point.FrameSelection(), edit.SelectRegion(Region(((0, 0), (1, 1)))), edit.Grow(),
    )  # fmt: skip
    assert after(State(), *every) == State()


def test_boxes_and_strokes_are_pixels() -> None:
    box = Region(((8.0, 5.0), (2.0, 1.0))).pixels(10, 8)
    assert box.sum() == 6 * 4 and box[1:5, 2:8].all()
    rows_, columns = np.mgrid[:40, :60] + 0.5
    disc = Region(((30.0, 20.0),), radius=7.0).pixels(60, 40)
    assert (disc == (np.hypot(columns - 30, rows_ - 20) <= 7)).all()
    stroke = Region(((5.0, 5.0), (50.0, 5.0), (50.0, 60.0)), radius=3.0).pixels(60, 40)
    along = (abs(rows_ - 5) <= 3) & (columns >= 5) & (columns <= 50)
    down = (abs(columns - 50) <= 3) & (rows_ >= 5)
    assert stroke[along | down].all() and stroke.sum() < 1.15 * (along | down).sum()
    half = Region(((8.0, 5.0), (2.0, 1.0))).pixels(5, 4, scale=0.5)
    assert half[:3, 1:4].all() and half.sum() == 9  # centres on the edge are inside


def answered(state: State) -> State:
    """With the phrase "door" found in the view on show."""
    state = after(state, ask.EditPrompt(0, "door"), do.Tick(1.0))
    revision = state.asking.revision
    histogram = Histogram(0, "door", (1,) * BINS)
    return after(state, ask.Answered(((0, "door", 0.99),), revision), ask.Binned((histogram,), revision))


@pytest.mark.parametrize(
    "change",
    [edit.Delete(), edit.Hide(), edit.Isolate(), edit.ToggleAtom(0), edit.MergeAtoms((0, 1))],
    ids=lambda command: type(command).__name__,
)
def test_a_score_goes_with_what_it_rests_on(shown: State, change: do.Command) -> None:
    """Otherwise what was deleted would still be found, and what is back would not."""
    before = answered(after(shown, found(0, CHAIRS)))
    assert before.asking.prompts[0].found and before.asking.histograms
    state = after(before, change)
    assert state.asking.prompts[0].score is None and state.asking.histograms == () and state.wants_maps
    late = after(state, ask.Answered(((0, "door", 0.99),), before.asking.revision))
    assert late == state  # the answer was about Gaussians that are gone
    again = answered(state)
    assert again.asking.prompts[0].score == 0.99
    assert after(again, edit.Undo()).asking.prompts[0].score is None


def test_selecting_keeps_the_scores(shown: State) -> None:
    state = after(answered(shown), found(0, CHAIRS), edit.Undo())
    assert state.asking.prompts[0].score == 0.99 and state.asking.histograms


def test_other_negatives_take_the_scores_away(shown: State) -> None:
    assert after(answered(shown), ask.SetNegatives(("thing",))).asking.prompts[0].score is None


def test_the_status_bar_counts_what_is_left(shown: State) -> None:
    assert "12,300 Gaussians" in figures(shown)
    state = after(shown, found(0, CHAIRS), edit.Delete())
    assert "9,800 of 12,300 Gaussians" in figures(state)
    assert "12,300 Gaussians" in figures(after(state, edit.Undo()))


def test_the_status_bar_tells_what_is_under_way(shown: State) -> None:
    """Its bar is at the panel's top: below the inventory nothing told that hiding went on."""
    state = shown.with_scene(job=Job("Hiding", "the photos"))
    assert figures(state)[0] == "Hiding: the photos" and not figures(shown)[0].startswith("Hiding")
