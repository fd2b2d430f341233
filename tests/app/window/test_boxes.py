"""Captions keep clear of what stands over the picture."""

from imgui_bundle import ImVec2, imgui

from app.window.kit.boxes import clear, overlap, windows_over, within
from app.window.kit.look import Look
from tests.app.window.headless import context, frames, look

BAR = (0.0, 0.0, 48.0, 460.0)


def test_boxes_that_touch_do_not_overlap() -> None:
    assert overlap((0, 0, 2, 2), (1, 1, 3, 3)) and not overlap((0, 0, 2, 2), (2, 0, 4, 2))
    assert within((1, 1, 2, 2), (0, 0, 2, 2)) and not within((1, 1, 3, 2), (0, 0, 2, 2))


def test_a_caption_leaves_a_panel_along_the_shortest_way() -> None:
    assert clear((30, 200, 90, 220), [BAR], 60) == (48, 200, 108, 220)
    assert clear((10, 450, 60, 470), [BAR], 60) == (10, 460, 60, 480)
    assert clear((100, 0, 150, 20), [BAR], 60) == (100, 0, 150, 20)


def test_a_caption_deep_in_a_panel_stays_covered() -> None:
    wide = (0.0, 0.0, 400.0, 400.0)
    box = (180.0, 190.0, 220.0, 210.0)
    assert clear(box, [wide], 40) == box and overlap(box, wide)


def test_windows_over_the_picture_are_found_but_for_what_comes_and_goes() -> None:
    found = []

    def windows(_look: Look) -> None:
        for name, at in (("bar", (10, 20)), ("aside", (700, 20))):
            imgui.set_next_window_pos(ImVec2(*at))
            imgui.set_next_window_size(ImVec2(60, 80))
            imgui.begin(name)
            imgui.end()
        imgui.set_tooltip("passing")
        imgui.begin("picture")
        found.append(windows_over((0, 0, 600, 600)))  # of the last frame
        imgui.end()

    with context((800, 600)):
        frames(windows, look())
    assert found[-1] == ((10, 20, 70, 100),)
