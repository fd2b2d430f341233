"""The tour in the window: every change is an edit, stops are flown to and asked, walks end, films follow."""

from dataclasses import replace
from pathlib import Path

import pytest

from app.window import commands as do
from app.window.editing import commands as edit
from app.window.exporting.order import Order, order
from app.window.kit.lengths import said
from app.window.scene import camera
from app.window.scene.standing import Levelled
from app.window.scene.state import FLIGHT_SECONDS
from app.window.state import State
from app.window.touring import commands as tour
from app.window.touring import panel
from langflash_core.base import outputs, pictures
from langflash_core.base.records import Guess, World
from langflash_core.geometry.poses import Vector, orbit, tour_seconds
from langflash_core.scene.tour import NO_TOUR, Note
from tests.app.window.scenes import after, shown_scene

GUESS = Guess(2.0, 1.6, 2.5, ("door",))


@pytest.fixture
def shown() -> State:
    return replace(shown_scene(), preferences=replace(State().preferences, near_photos=False))


def toured(state: State, count: int = 3) -> State:
    for step in range(count):
        state = after(state, camera.MoveTo(orbit(state.scene.pose, 0.1 * step, 0.02)), tour.AddStop())
    return state


def test_stops_are_edits_with_names_an_order_and_a_start(shown):
    state = toured(shown)
    assert state.tour.names == ("Stop 1", "Stop 2", "Stop 3") and state.touring.open
    assert state.tour.stops[2].pose == state.scene.pose and state.editing.unsaved
    for command in (
        tour.ChangeStop(1, name="Window"), tour.ChangeStop(1, text="Look out."), tour.MoveStop(0, 2),
        tour.StartAt("Stop 2"), tour.RemoveStop(0), tour.AddNote("here", Vector(0, 0, 1)),
        tour.ChangeStop(0, here=True),
    ):  # fmt: skip
        changed = after(state, command)
        assert changed.tour != state.tour and after(changed, edit.Undo()).tour == state.tour
    assert after(state, tour.RemoveStop(0), tour.AddStop()).tour.names == ("Stop 2", "Stop 3", "Stop 1")
    assert after(state, tour.StartAt("Stop 2"), tour.ChangeStop(1, name="B")).tour.start == "B"
    assert not after(state, *[edit.Undo()] * 3).editing.unsaved


def test_what_cannot_be_is_told_and_changes_nothing(shown):
    state = toured(shown, 2)
    twice = after(state, tour.ChangeStop(0, name="Stop 2"))
    assert "called Stop 2 already" in twice.toasts[-1].text and twice.tour == state.tour
    assert after(shown, tour.GoToStop(0)).toasts[-1].text.startswith("There are no stops yet")
    assert after(toured(shown, 1), tour.Play()).filming.tour is None
    assert after(State(), tour.AddStop()).tour == NO_TOUR, "without a scene there is nothing to show"


def test_one_flies_to_a_stop_and_is_asked_its_phrase(shown):
    asking = shown.with_scene(mode=pictures.HEAT)
    state = toured(asking, 1)
    assert asking.asking.active_prompt is not None
    phrase = asking.asking.active_prompt.text
    assert state.tour.stops[0].phrase == phrase
    assert not toured(shown.with_scene(mode=pictures.RGB)).tour.stops[0].phrase
    away = after(state, camera.MoveTo(orbit(state.scene.pose, 0.5, 0)), camera.SetMode(pictures.RGB))
    there = after(away, tour.GoToStop(0))
    assert there.scene.flight is not None and there.scene.mode is pictures.HEAT and there.touring.place == 0
    landed = after(there, do.Tick(there.now + 2 * FLIGHT_SECONDS))
    assert landed.scene.pose == state.tour.stops[0].pose
    assert len(landed.asking.prompts) == len(asking.asking.prompts), "it was asked already"
    pinned = after(shown, tour.AddNote("seat", Vector(0, 0, 1), phrase="a comfy seat"), tour.AskNote(0))
    shown_phrase = pinned.asking.active_prompt
    assert shown_phrase is not None and shown_phrase.text == "a comfy seat"


def test_steps_go_around_and_a_walk_ends_at_the_last_stop(shown):
    state = toured(shown)
    places = []
    for by in (1, 1, 1, -1):
        state = after(state, tour.Step(by))
        places.append(state.touring.place)
    assert places == [0, 1, 2, 1]
    walking = after(state, tour.Play())
    halfway = after(walking, do.Tick(walking.now + 0.5 * tour_seconds(3)))
    assert halfway.filming.tour is not None and halfway.scene.pose == state.tour.stops[1].pose
    ended = after(walking, do.Tick(walking.now + tour_seconds(3) + 0.1))
    assert ended.filming.tour is None and ended.scene.pose == state.tour.stops[2].pose
    assert after(halfway, camera.MoveTo(shown.scene.pose)).filming.tour is None, "hands on the picture end it"


def test_notes_of_a_point_and_of_a_length(shown):
    ends = Vector(0, 0, 1), Vector(0.3, 0, 1)
    state = after(shown, tour.AddNote("seat", ends[0], phrase="seat"), tour.AddNote("Measure", *ends))
    assert state.tour.notes == (Note("seat", ends[0], phrase="seat"), Note("Measure", *ends))
    measure = state.tour.notes[1]
    assert panel._measured(state, measure) == "0.300 units"
    levelled = after(
        state, Levelled(World((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "edges", 0.5, "floor", "walls", GUESS))
    )
    assert panel._measured(levelled, measure) == said(0.3, None, GUESS) == "about 60 cm"
    renamed = after(state, tour.ChangeNote(1, "Door"), tour.RemoveNote(0))
    assert [note.text for note in renamed.tour.notes] == ["Door"]
    assert after(renamed, edit.Undo(), edit.Undo()).tour == state.tour


def test_films_go_along_the_tour(shown):
    form = replace(shown.exporting.form, what=outputs.VIDEO, path="/out/film")
    state = toured(shown).with_exporting(form=form, edited=Path("/cache/edited.langflash"))
    wanted = order(state)
    assert isinstance(wanted, Order) and wanted.request.path == "tour"
    none = order(shown.with_exporting(form=replace(form, way="tour")))
    assert none == "A film along the tour needs a stop; fly somewhere and add one in the tour's panel."
