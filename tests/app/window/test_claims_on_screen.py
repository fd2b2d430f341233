"""What was found covered, missing or repeated on the screen, on a real ImGui context without a window."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from imgui_bundle import ImVec2, imgui

from app.window.asking.panels import dictionary
from app.window.asking.state import Prompt
from app.window.commands import Command
from app.window.editing import commands as edit
from app.window.editing.panels import tools
from app.window.kit.boxes import overlap
from app.window.kit.look import Look
from app.window.scene.camera import SwitchRays
from app.window.scene.panels import axes, in_space, tray
from app.window.scene.state import Photo
from app.window.state import State
from langflash_core.geometry.poses import Vector
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import History, Mask
from tests.app.window.headless import box, context, frames, look
from tests.app.window.scenes import after, shown_scene

LEFT, TOP, STATUS = 348, 52, 32  # of the picture's place, design pixels


def place(size: tuple[int, int]) -> tuple[ImVec2, ImVec2]:
    return ImVec2(LEFT, TOP), ImVec2(size[0] - LEFT, size[1] - TOP - STATUS)


def all_selected() -> State:
    state = shown_scene()
    assert state.scene.info is not None
    count = len(state.scene.info.scene.gaussians)
    history = History(first_marks(state.scene.info.scene))
    state = state.with_editing(history=history, names=(("a",), ("b",), ("c",)))
    state = after(state, edit.Found(Mask.of(np.ones(count, bool)), "replace", "all"))
    return replace(state, preferences=replace(state.preferences, dictionary_open=True, dictionary=None))


@pytest.mark.parametrize("size", [(1280, 800), (1920, 1080), (1100, 720)])
def test_the_selections_bar_ends_before_the_dictionary(size: tuple[int, int]) -> None:
    state = all_selected()

    def panels(seen: Look) -> None:
        tools.draw(state, seen, *place(size))
        dictionary.draw(state, seen, *place(size))

    with context(size):
        frames(panels, look(), 6)
        assert not overlap(box("##bar0"), box("Dictionary"))


def test_a_warning_that_every_photo_and_the_scene_repeat_is_said_once() -> None:
    state = shown_scene()
    assert state.scene.info is not None
    said = "it is dark"
    photos = tuple(Photo(path, notes=(said,)) for path in map(Path, "abcdefgh"))
    state = state.with_scene(photos=photos, info=replace(state.scene.info, warnings=(said, said)))
    assert tray._sentences(state) == ["It is dark."]


def test_notes_of_several_photos_are_one_sentence_until_the_scene_says_it() -> None:
    state = shown_scene()
    assert state.scene.info is not None
    notes = {name: (f"{name} is very dark; take it again with more light",) for name in ("a.jpg", "b.jpg")}
    photos = tuple(Photo(Path(name), notes=said) for name, said in notes.items())
    joined = ["Photos 1 and 2 are very dark; take them again with more light."]
    assert tray._sentences(state.with_scene(photos=photos, info=None)) == joined
    made = state.scene.info.scene.with_record(photos=tuple(notes), warnings=sum(notes.values(), ()))
    info = replace(state.scene.info, scene=made, warnings=("both are dark",))
    assert tray._sentences(state.with_scene(photos=photos, info=info)) == ["Both are dark."]


def drawn_over(state: State) -> list[float]:
    """How far to the right each vertex of what is marked in the picture stands."""
    with context((1280, 800)):
        found: list[list[float]] = []

        def panel(seen: Look) -> None:
            imgui.set_next_window_pos(ImVec2(LEFT, TOP))
            imgui.set_next_window_size(ImVec2(932, 716))
            imgui.begin("##picture")
            before = imgui.get_window_draw_list().vtx_buffer.size()
            in_space.draw(state, seen, *place((1280, 800)))
            buffer = imgui.get_window_draw_list().vtx_buffer
            found.append([buffer[each].pos.x for each in range(before, buffer.size())])
            imgui.end()

        frames(panel, look())
        return found[-1]


def test_the_best_candidate_of_a_maybe_is_marked_and_that_of_nothing_is_not() -> None:
    shown = replace(shown_scene(), preferences=replace(State().preferences, photos_in_space=False))
    row = Prompt(9, "curtain", score=0.82, calibrated=0.83, place=Vector(0.0, 0.0, 1.0))
    assert row.maybe and drawn_over(shown.with_asking(prompts=(row,)))
    missed = replace(row, score=0.3)
    assert not missed.maybe and drawn_over(shown.with_asking(prompts=(missed,))) == []


@pytest.mark.parametrize("x", np.linspace(0.3, 0.9, 7))
def test_the_name_of_a_candidate_ends_in_the_picture(x: float) -> None:
    """To the right of its ring it was cut off by the window's edge."""
    shown = replace(shown_scene(), preferences=replace(State().preferences, photos_in_space=False))
    row = Prompt(9, "kitchen island", score=0.82, calibrated=0.83, place=Vector(x, 0.0, 1.0))
    drawn = drawn_over(shown.with_asking(prompts=(row,)))
    assert max(drawn, default=0.0) <= 1280 + 28, "the ring, 26 pixels and its line, may reach over"


def test_the_kind_of_rays_is_a_button_beside_the_axes() -> None:
    """Pressed with the pointer, as a person does it."""
    state, issued = shown_scene(), list[Command]()

    def panel(seen: Look) -> None:
        issued.extend(axes.draw(state, seen, *place((1280, 800))))

    with context((1280, 800)):
        frames(panel, look())
        left, _, _, bottom = box("##axes")
        io = imgui.get_io()
        io.add_mouse_pos_event(left + 12, bottom - 12)
        frames(panel, look(), 2)
        io.add_mouse_button_event(0, True)
        frames(panel, look(), 2)
        io.add_mouse_button_event(0, False)
        frames(panel, look(), 2)
    assert [command for command in issued if isinstance(command, SwitchRays)] == [SwitchRays()]
