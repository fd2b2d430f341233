"""Every control of bars and panels over the picture is reached by Tab, also where the window is small."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest
from imgui_bundle import ImVec2, imgui

from app.window.asking.panels import dictionary
from app.window.editing import commands as edit
from app.window.editing.panels import cleaning, tools
from app.window.editing.state import Floaters, Hiding, Tint, Tool
from app.window.frame.keys import AREAS
from app.window.kit import theme
from app.window.kit.look import Look
from app.window.state import State
from app.window.touring import commands as tour
from app.window.touring import panel as tour_panel
from langflash_core.geometry.poses import Vector
from tests.app.window.headless import context, frames, look
from tests.app.window.scenes import after
from tests.app.window.test_small_windows import edited

_KINDS = ("button", "checkbox", "selectable", "input_text", "input_text_with_hint", "slider_float")
_SIZES = ((800, 500), (1280, 800))


def noted() -> State:
    """The tour's panel with two stops and three notes: at 800 x 500 it scrolls."""
    state = after(edited(), edit.Deselect(), tour.ShowTour(True), tour.AddStop(), tour.AddStop())
    for number in range(3):
        state = after(state, tour.AddNote(f"note {number}", Vector(0.0, 0.0, 1.0 + number)))
    return state


def cleaned() -> State:
    return edited(floaters=Floaters(bytes(4 * 12_300), open=True))


Draw = Callable[[State, Look, ImVec2, ImVec2], object]
_PLACES: tuple[tuple[str, State, Draw], ...] = (
    ("##bar1", edited(tool=Tool.BRUSH), tools.draw),
    ("##bar0", edited(tool=Tool.CLONE, source=(0.0, 0.0, 1.0)), tools.draw),
    ("##bar1", edited(hiding=Hiding("blur")), tools.draw),
    ("##bar1", cleaned(), tools.draw),
    ("Rules", cleaned(), cleaning.draw),
    ("Tour", noted(), tour_panel.draw),
)


@pytest.fixture
def controls(monkeypatch) -> dict[str, dict[int, str]]:
    """Of each window the controls that can be used, by their id, as they are drawn."""
    found: dict[str, dict[int, str]] = {}

    def noting(real: Callable) -> Callable:
        def item(label: str, *rest, **named):
            given = real(label, *rest, **named)
            now = imgui.get_current_context()
            if not now.last_item_data.item_flags & imgui.ItemFlags_.disabled.value:
                found.setdefault(now.current_window.name, {})[now.last_item_data.id_] = label
            return given

        return item

    for kind in _KINDS:
        monkeypatch.setattr(imgui, kind, noting(getattr(imgui, kind)))
    return found


def visited(name: str, draw: Callable[[Look], object], presses: int) -> Iterator[int]:
    """Ids of what has the focus, Tab after Tab, beginning as F6 does."""
    io, now = imgui.get_io(), imgui.get_current_context()
    window = imgui.internal.find_window_by_name(name)
    assert window is not None
    imgui.internal.focus_window(window)
    imgui.internal.nav_init_window(window, True)
    for _ in range(presses):
        frames(draw, look(), 2)
        yield now.nav_id
        io.add_key_event(imgui.Key.tab, True)
        frames(draw, look(), 1)
        io.add_key_event(imgui.Key.tab, False)
        frames(draw, look(), 1)


@pytest.mark.parametrize("size", _SIZES)
@pytest.mark.parametrize(
    "place", range(len(_PLACES)), ids=["brush", "clone", "hide", "clean", "rules", "tour"]
)
def test_tab_goes_to_every_control(
    controls: dict[str, dict[int, str]], place: int, size: tuple[int, int]
) -> None:
    name, state, panel = _PLACES[place]
    assert name in AREAS
    corner = ImVec2(348, 52)
    room = ImVec2(size[0] - 348, size[1] - 84)
    with context(size):
        theme.set_up(1.0, "dark")
        io = imgui.get_io()
        io.config_flags |= imgui.ConfigFlags_.nav_enable_keyboard.value
        draw = lambda seen: panel(state, seen, corner, room)  # noqa: E731
        frames(draw, look(), 5)
        wanted = dict(controls[name])
        reached = set(visited(name, draw, 2 * len(wanted)))
    assert len(wanted) > 2
    assert [label for key, label in wanted.items() if key not in reached] == []


def test_the_rows_of_the_dictionary_are_reached_too(controls: dict[str, dict[int, str]]) -> None:
    """Tab went past them: they lie in a part of its window of its own."""
    state = replace(edited(), preferences=replace(State().preferences, dictionary_open=True))
    with context((1280, 800)):
        theme.set_up(1.0, "dark")
        draw = lambda seen: dictionary.draw(state, seen, ImVec2(348, 52), ImVec2(932, 716))  # noqa: E731
        frames(draw, look(), 5)
        wanted = {key: label for name in controls for key, label in controls[name].items()}
        assert sum(label == "##name" for label in wanted.values()) == 3
        reached = set(visited("Dictionary", draw, 2 * len(wanted)))
    assert [label for key, label in wanted.items() if key not in reached] == []


def test_as_many_bars_as_there_can_be_are_areas_of_f6() -> None:
    """The fifth was none: with all of them open, the keys went past the clean-up."""
    state = edited(tool=Tool.BRUSH, tint=Tint(), hiding=Hiding("blur"), floaters=Floaters(bytes(4 * 12_300)))
    with context((1280, 800)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: tools.draw(state, seen, ImVec2(348, 52), ImVec2(932, 700)), look())
        bars = {f"##bar{n}" for n in range(9) if imgui.internal.find_window_by_name(f"##bar{n}") is not None}
    assert len(bars) == 5 and bars <= set(AREAS)
