"""What hands met that tried the window's corners: what is cut, hidden below an edge, or lost while typing."""

from dataclasses import replace

import numpy as np
import pytest
from imgui_bundle import ImVec2, imgui

from app.window.commands import Tick
from app.window.dialogs import Dialog
from app.window.editing.cleaning import ChangeRecipe
from app.window.editing.panels import cleaning, history
from app.window.editing.panels import pointing as card_panel
from app.window.editing.state import Card, Floaters, Reading
from app.window.frame import dialogs
from app.window.frame.status import figures
from app.window.kit import theme, widgets
from app.window.kit.look import Look
from app.window.scene import camera
from app.window.scene.commands import SceneArrived, room_of
from app.window.scene.near import flown_past
from app.window.scene.state import SceneInfo
from app.window.touring import commands as tour
from app.window.touring import panel as tour_panel
from langflash_core.geometry.poses import Pose, Vector, orbit, tour_seconds
from langflash_core.mending.recipes import Recipe
from langflash_core.scene.settings import TOURS
from tests.app.window.headless import box, context, frames, look
from tests.app.window.items import Items
from tests.app.window.scenes import VIEWS, after, shown_scene
from tests.app.window.test_small_windows import edited
from tests.app.window.test_stumbles import Hands, items

__all__ = ["items"]  # a fixture

BIG, SMALL = (ImVec2(348, 52), ImVec2(932, 716)), (ImVec2(348, 52), ImVec2(452, 416))
CROP = (-1.0, -1.0, 0.0, 1.0, 1.0, 2.0)
WORDS = tuple((word, 0.5) for word in ("wall", "ceiling", "floor", "window", "door", "table"))


@pytest.mark.parametrize(("size", "place"), [((1280, 800), BIG), ((800, 500), SMALL)])
def test_an_answer_about_the_lower_edge_ends_above_it(size, place) -> None:
    """Its last line hung over the figures at the bottom."""
    low = Reading((120.0, place[1].y - 20), (0.0, 0.4, 1.0), 1.0, ((0, 0.9),))
    state = edited(card=Card(low, WORDS, bytes(8))).with_scene(pose=Pose())
    with context(size):
        theme.set_up(1.0, "dark")
        frames(lambda seen: card_panel.draw(state, seen, *place), look(), 5)
        _left, top, _right, bottom = box("##card")
    assert top >= place[0].y and bottom <= place[0].y + place[1].y


def test_a_box_to_clean_up_outside_of_needs_no_scrolling() -> None:
    """What saves the recipe was below the edge, with room under it."""
    preview = replace(Floaters(bytes(4 * 12_300)), open=True, box=CROP, recipe=Recipe(crop=CROP))
    with context((1280, 800)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: cleaning.draw(edited(floaters=preview), seen, *BIG), look(), 5)
        window = imgui.internal.find_window_by_name("Rules")
        assert window is not None and window.scroll_max.y == 0
        assert box("Rules")[3] <= 768


def test_a_box_by_numbers_begins_around_the_scene(items: Items) -> None:
    """It began with a unit each way, and half of the room was red."""
    state = edited(floaters=replace(Floaters(bytes(4 * 12_300)), open=True))
    info = state.scene.info
    assert info is not None
    state = state.with_scene(info=replace(info, extent=(Vector(-2, -1, 0.5), Vector(1, 1.5, 3))))
    with context((1280, 800)):
        theme.set_up(1.0, "dark")
        hands = Hands(lambda seen: cleaning.draw(state, seen, *BIG))
        hands.frames(4)
        left, top, right, bottom = items.now()["By numbers"][0]
        hands.click((left + right) / 2, (top + bottom) / 2)
    assert ChangeRecipe({"crop": (-2, -1, 0.5, 1, 1.5, 3)}) in hands.issued


@pytest.mark.parametrize("size", [(800, 500), (1280, 800)])
@pytest.mark.parametrize(
    ("dialog", "buttons"), [(Dialog.EXPORT, ("Export", "Close")), (Dialog.OPEN, ("Open", "Cancel"))]
)
def test_what_a_dialog_does_is_never_scrolled_away(
    items: Items, size: tuple[int, int], dialog: Dialog, buttons: tuple[str, ...]
) -> None:
    state = replace(edited(), dialog=dialog)
    with context(size):
        theme.set_up(1.0, "dark")
        frames(lambda seen: dialogs.draw(state, seen), look(), 8)
        left, top, right, bottom = box(dialog.value)
        window = imgui.internal.find_window_by_name(dialog.value)
        for name in buttons:
            ((start, high, end, low),) = next(b for label, b in items.now().items() if label.startswith(name))
            assert left < start < end < right and top < high < low < bottom <= size[1]
    assert window is not None and window.scroll_max.y == 0


def hovered(draw, at: tuple[float, float]) -> str | None:
    """What a tooltip says after a while at a place."""
    said: list[str] = []
    real = imgui.text_unformatted, imgui.set_tooltip
    imgui.text_unformatted = lambda text: said.append(text)  # type: ignore[method-assign]
    imgui.set_tooltip = lambda text: said.append(text)  # type: ignore[method-assign]
    try:
        for _ in range(60):
            imgui.get_io().add_mouse_pos_event(*at)
            imgui.get_io().delta_time = 0.1
            frames(draw, look(), 1)
    finally:
        imgui.text_unformatted, imgui.set_tooltip = real  # type: ignore[method-assign]
    return said[-1] if said else None


@pytest.mark.parametrize("name", ["Stop 1", "The corner with the plant and the little table, left"])
def test_a_name_that_is_cut_is_read_in_whole_on_hover(items: Items, name: str) -> None:
    state = after(shown_scene(), tour.AddStop(), tour.ChangeStop(0, name=name))
    with context((1280, 800)):
        theme.set_up(1.0, "dark")

        def draw(seen: Look) -> None:
            tour_panel.draw(state, seen, *BIG)

        frames(draw, look(), 4)
        left, top, right, bottom = items.now()["##name"][0]
        assert hovered(draw, ((left + right) / 2, (top + bottom) / 2)) == (
            "Its name" if name == "Stop 1" else name
        )


def test_of_too_long_a_name_what_there_is_room_for_is_kept() -> None:
    """All that was typed went away, with a sentence that it was too long."""
    for most, change in ((TOURS.longest_name, "name"), (TOURS.longest_text, "text")):
        typed, told = tour_panel._cut("  " + "plant " * 100, most, "A stop's name")
        named = tour.ChangeStop(0, name=typed) if change == "name" else tour.ChangeStop(0, text=typed)
        state = after(shown_scene(), tour.AddStop(), named, *told)
        assert getattr(state.tour.stops[0], change).strip() == ("plant " * 100)[:most].strip()
        assert f"at most {most} letters" in state.toasts[-1].text
    assert tour_panel._cut(" short ", TOURS.longest_name, "") == ("short", [])


def test_the_present_edit_is_seen_where_the_list_stands_low() -> None:
    state = shown_scene()
    for _ in range(8):
        state = after(state, tour.AddStop())
    with context((348, 500)):
        theme.set_up(1.0, "dark")

        def draw(seen: Look) -> None:
            imgui.set_next_window_pos(ImVec2(0, 0))
            imgui.set_next_window_size(ImVec2(348, 500))
            imgui.begin("panel")
            widgets.gap(260)
            history.draw(state, seen)
            imgui.end()

        frames(draw, look(), 4)
        window = imgui.internal.find_window_by_name("panel")
        assert window is not None and window.scroll_max.y == 0


def test_the_tour_says_where_it_is_as_it_plays() -> None:
    """The stop where one was before stayed marked."""
    state = shown_scene()
    for step in range(3):
        state = after(state, camera.MoveTo(orbit(state.scene.pose, 0.1 * step, 0.02)), tour.AddStop())
    playing, places = after(state, tour.Play()), []
    for share in (0.0, 0.5, 0.99):
        playing = after(playing, Tick(state.now + share * tour_seconds(3)))
        places.append(playing.touring.place)
    assert places == [0, 1, 2]
    ended = after(playing, Tick(state.now + tour_seconds(3) + 1))
    assert ended.filming.tour is None and ended.touring.place == 2


def test_who_flew_out_of_the_scene_is_told_the_way_back() -> None:
    state = shown_scene()
    info = state.scene.info
    assert info is not None
    known = replace(info, extent=(Vector(-1, -1, 0.5), Vector(1, 1, 2)))
    for z, past in ((0.0, False), (1.9, False), (2.1, True)):
        there = state.with_scene(info=known, pose=replace(Pose(), centre=Vector(0, 0, z)))
        assert flown_past(there) == past
        assert any("press H to go back" in text for text in figures(there)) == past
    turned = orbit(replace(Pose(), centre=Vector(0, 0, 3)), np.pi, 0.0)
    assert not flown_past(state.with_scene(info=known, pose=replace(turned, centre=Vector(0, 0, 3))))
    assert not flown_past(state)


def test_a_scene_with_more_in_it_is_still_seen_from_the_photo() -> None:
    """After a filled hole the photo was no longer marked, and could not be compared with."""
    state = shown_scene().with_scene(pose=VIEWS[1], view=1)
    info = state.scene.info
    assert isinstance(info, SceneInfo)
    room = room_of(state, info)
    assert after(state, SceneArrived(info, room=room, replaces=True)).scene.view == 1
    elsewhere = replace(room, pose=orbit(VIEWS[1], 0.3, 0.0))
    assert after(state, SceneArrived(info, room=elsewhere, replaces=True)).scene.view is None


def test_what_the_rest_means_is_said() -> None:
    """With a box, "All the rest instead" took nearly everything."""
    seen: list[str] = []
    real = widgets.tooltip
    widgets.tooltip = seen.append
    try:
        with context((1280, 800)):
            theme.set_up(1.0, "dark")
            preview = replace(Floaters(bytes(4 * 12_300)), open=True)
            frames(lambda at: cleaning.draw(edited(floaters=preview), at, *BIG), look(), 2)
    finally:
        widgets.tooltip = real
    assert any("all outside a box still goes" in text for text in seen)
