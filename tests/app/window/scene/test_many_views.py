"""The buttons of a scene's photos stay in the window, however many there are."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from imgui_bundle import ImVec2, imgui

from app.window.frame import layout
from app.window.kit import theme, widgets
from app.window.scene.panels import views
from tests.app.window import headless
from tests.app.window.scenes import VIEWS, shown_scene, with_info


@pytest.mark.parametrize("aspect", (None, 1.5), ids=["numbers", "pictures"])
@pytest.mark.parametrize("count", (2, 5, 9, 32))
def test_the_switches_beside_the_photos_are_in_sight(count: int, aspect: float | None) -> None:
    """Five photos lengthwise pushed them over the edge."""
    shown = None if aspect is None else (imgui.ImTextureRef(1), aspect)
    thumbnails = SimpleNamespace(get=lambda name: shown if name.startswith("view") else None)
    state = with_info(shown_scene(), views=VIEWS[:1] * count)
    with headless.context((900, 600)):
        theme.set_up(1.0)
        look = replace(headless.look(), thumbnails=thumbnails)  # pyright: ignore[reportArgumentType]
        headless.frames(lambda seen: layout.draw_all(state, seen), look, 6)
        left, top, right, bottom = headless.box("##views")
    assert left >= 0 and right <= 900 and bottom <= 600 and bottom - top <= 90


def test_a_photo_that_does_not_look_right_is_marked_and_says_why(monkeypatch) -> None:
    state, marks, tips = shown_scene(), [], []
    doubtful = with_info(state, doubts={1: "It stands alone; take more photos."})
    monkeypatch.setattr(views, "_mark", marks.append)
    monkeypatch.setattr(widgets, "tooltip", tips.append)
    with headless.context((900, 600)):
        theme.set_up(1.0)
        look = headless.look()
        headless.frames(lambda look: layout.draw_all(doubtful, look), look, 1)
        assert marks == [look] and "Go to where photo 2 was taken\nIt stands alone; take more photos." in tips
        headless.frames(lambda look: layout.draw_all(state, look), look, 1)
        assert marks == [look]


def test_the_mark_is_in_the_corner_of_the_photo() -> None:
    with headless.context((900, 600)):
        theme.set_up(1.0)
        drawn = []

        def draw(look) -> None:
            imgui.button("photo", ImVec2(80, 54))
            before = imgui.get_window_draw_list().vtx_buffer.size()
            views._mark(look)
            drawn.append(imgui.get_window_draw_list().vtx_buffer.size() - before)

        headless.frames(draw, headless.look(), 1)
        assert drawn[0] > 8  # a disc and a letter
