"""Notes in the picture: those behind a surface are told from those before it by what is drawn."""

from dataclasses import replace

import pytest
import torch
from imgui_bundle import ImVec2, imgui

from app.window import commands as do
from app.window.effects import Hands
from app.window.kit import theme
from app.window.state import State
from app.window.touring import commands as tour
from app.window.touring import panel
from app.window.touring.effects import TouringEffects
from app.window.viewport import Viewport
from langflash_core.geometry.poses import Vector, orbit
from langflash_core.scene.tour import Note
from tests.app.window.headless import context as window
from tests.app.window.headless import frames, look
from tests.app.window.scenes import CHAIR, after, room, shown_scene

SIZE = (240, 180)
ON = Vector(CHAIR[0], CHAIR[1], CHAIR[2] - 0.2)  # the block's front
BEHIND = Vector(*(1.8 * value for value in ON))  # on the ray through that, before the wall
NOTES = (
    Note("block", ON),
    Note("behind", BEHIND),
    Note("one end seen", BEHIND, Vector(0.5, -0.2, 1.3)),
    Note("none seen", BEHIND, Vector(*(1.7 * value for value in ON))),
    Note("beside the picture", Vector(9.0, 0.0, 1.3)),
    Note("before all", Vector(0.0, 0.0, 0.3)),
)


def noted() -> State:
    state = after(shown_scene(), tour.ShowTour(True))
    for note in NOTES:
        state = after(state, tour.AddNote(note.text, note.at, note.to))
    return state


def test_a_note_is_behind_what_the_picture_shows_before_it(context) -> None:
    """They were all drawn alike, also through walls."""
    state = replace(noted(), preferences=replace(State().preferences, near_photos=False))
    asked: list[do.Command] = []
    scene = room(torch.eye(3))
    assert state.scene.info is not None
    state = state.with_scene(info=replace(state.scene.info, scene=scene)).with_asking(prompts=())
    with context:
        viewport = Viewport(context)
        effects = TouringEffects(
            Hands(asked.append, asked.append, lambda _: None, lambda: None, lambda: 0.0), viewport
        )
        viewport.set_scene(1, scene)

        def judged(state: State) -> set[str] | None:
            """Names of those behind; None: nothing new is said."""
            asked.clear()
            for _ in range(4):
                viewport.update(state, SIZE, touched=0.0)
                effects.after_picture(state)
            found = [command for command in asked if isinstance(command, tour.NotesJudged)]
            return {note.text for note in found[-1].behind} if found else None

        assert judged(state) == {"behind", "none seen"}
        state = state.with_touring(
            behind=frozenset(note for note in NOTES if note.text in ("behind", "none seen"))
        )
        assert judged(state) is None
        around = state.with_scene(pose=orbit(state.scene.pose, 0.7, 0.0))
        assert judged(around) == set(), "from aside nothing is before it"
        away = state.with_touring(open=False)
        assert judged(away) == set() and judged(away.with_touring(behind=frozenset())) is None
        viewport.release()


@pytest.mark.parametrize("behind", [False, True])
def test_a_note_that_is_behind_is_a_faint_mark_without_words(monkeypatch, behind: bool) -> None:
    state = after(shown_scene(), tour.ShowTour(True), tour.AddNote("block", ON))
    state = after(state, tour.NotesJudged(frozenset(state.tour.notes) if behind else frozenset()))
    words: list[str] = []
    monkeypatch.setattr(panel.widgets, "caption", lambda text, *_, **__: words.append(text))

    def drawn(seen) -> list:
        imgui.begin("picture")
        panel.draw_notes(state, seen, ImVec2(0, 0), ImVec2(400, 300))
        imgui.end()
        return []

    with window((400, 300)):
        theme.set_up(1.0, "dark")
        frames(drawn, look())
    assert set(words) == (set() if behind else {"block"})
