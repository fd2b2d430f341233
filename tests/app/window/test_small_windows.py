"""Nothing covers anything else where the window is small or the interface large."""

from dataclasses import replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path

import pytest
from imgui_bundle import ImVec2, imgui

from app.window.commands import Command
from app.window.dialogs import Dialog
from app.window.editing import commands as edit
from app.window.editing.panels import tools
from app.window.editing.panels.tools import _GAP, _MARGIN, _TOOLS, tool_side
from app.window.editing.state import Floaters, Hiding, Reached, Tint, Tool
from app.window.filming import commands as film
from app.window.frame import dialogs, layout
from app.window.inventory import commands as take
from app.window.kit import theme, widgets
from app.window.kit.boxes import bars, overlap, window_box
from app.window.kit.look import Look
from app.window.recovery import commands as keep
from app.window.recovery.state import Kept, Offer
from app.window.scene.panels.legend import covers_views
from app.window.state import State
from app.window.touring import commands as tour
from langflash_core.scene.mask import Mask
from tests.app.window.headless import box, context, frames, look
from tests.app.window.items import Items
from tests.app.window.rows import Rows
from tests.app.window.scenes import after, shown_scene, with_info
from tests.app.window.test_stumbles import Hands, items

__all__ = ["items"]  # a fixture

SEPARATORS = 2 * (1 + _GAP) + 12  # two lines, and the strip's padding


@pytest.mark.parametrize(("window", "scale"), [((800, 500), 1.0), ((1280, 800), 1.5), ((1920, 1080), 1.0)])
def test_the_tools_end_above_the_viewpoints(window: tuple[int, int], scale: float) -> None:
    height = window[1] / scale - 52 - 32  # toolbar and status bar
    side = tool_side(height)
    strip = (len(_TOOLS) + 3) * (side + _GAP) + SEPARATORS
    assert _MARGIN + strip <= height - 88
    assert side == 36 if height > 500 else side >= 20  # icons are 16


def test_the_legend_makes_room_for_the_viewpoints() -> None:
    assert covers_views(452, 2) and not covers_views(932, 2) and covers_views(932, 9)


def edited(**changes) -> State:
    """Everything is selected, as Ctrl+A does."""
    return after(shown_scene(), edit.SelectAll()).with_editing(**changes)


@pytest.mark.parametrize("scale", [1.0, 1.5])
@pytest.mark.parametrize(
    "state",
    [
        edited(tool=Tool.BRUSH),
        edited(tool=Tool.CLONE, source=(0.0, 0.0, 1.0)),
        edited(tool=Tool.PLACE),
        edited(tint=Tint((0.8, 0.2, 0.2), 0.8)),
        edited(floaters=Floaters(bytes(4 * 12_300))),
        edited(hiding=Hiding("blur")),
    ],
    ids=["brush", "clone", "gizmo", "tint", "floaters", "hiding"],
)
def test_bars_end_where_the_window_ends(state: State, scale: float) -> None:
    """At 800 x 500 the selection's bar ended with half a bin, and the way out of it was beyond."""
    place, size = ImVec2(348 * scale, 52 * scale), ImVec2(800 * scale - 348 * scale, 416 * scale)
    with context((round(800 * scale), round(500 * scale))):
        theme.set_up(scale, "dark")
        frames(lambda seen: tools.draw(state, seen, place, size), look(scale))
        boxes = [box(f"##bar{number}") for number in range(2)]
    for _left, _top, right, _bottom in boxes:
        assert right <= 800 * scale - tools._MARGIN * scale + 1
    assert boxes[0][3] <= boxes[1][1]


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"tool": Tool.BRUSH}, "Radius"),
        ({"tool": Tool.PICK}, "Size"),
        ({"tint": Tint((0.8, 0.2, 0.2), 0.8)}, "Strength"),
        ({"floaters": Floaters(bytes(4 * 12_300))}, "Strength"),
        ({"hiding": Hiding("blur")}, "Margin"),
    ],
    ids=["brush", "levels", "tint", "floaters", "hiding"],
)
def test_a_slider_over_the_picture_says_what_it_is(monkeypatch, changes: dict, name: str) -> None:
    """Its name stood in the tip alone, so there were two bare knobs in a row."""
    rows, state = Rows(monkeypatch), edited(**changes)
    history = state.editing.history
    assert history is not None
    if state.editing.tool is Tool.PICK:
        masks = Mask.first(4, 1), Mask.first(4, 2)
        state = state.with_editing(clicked=Reached(masks, 0, "replace", history, history))
    with context((800, 500)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: tools.draw(state, seen, ImVec2(348, 52), ImVec2(452, 416)), look())
    shown = [row for row in rows.now() if row.window.startswith("##bar")]
    named = [(last, row) for last, row in pairwise(shown) if row.kind == "slider_float"]
    assert name in [last.words for last, _ in named]
    for last, row in named:
        assert (
            last.kind == "text_colored"
            and last.box[2] <= row.box[0]
            and last.box[1] < row.box[3]
            and row.box[1] < last.box[3]
        )


def test_warnings_leave_room_for_the_answer(monkeypatch) -> None:
    """At 900 x 560 some warnings of photos pushed "found" and "not found" out of the panel."""
    rows = Rows(monkeypatch)
    told = "does not meet the photos beside it; take more photos there, with more light, and hold still"
    said = tuple(f"photo {number} {told}" for number in range(1, 5))
    state = with_info(shown_scene(), warnings=said)
    asked = state.with_asking(prompts=(replace(state.asking.prompts[0], score=0.1),))
    with context((900, 560)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: layout.draw_all(asked, seen), look())
    answer = next(row for row in rows.now() if "not found" in row.words)
    assert answer.box[3] <= answer.inside[3]
    warned = [row.words for row in rows.now() if row.words.startswith("Photo ")]
    assert len(warned) == 4 and all(words.endswith("...") for words in warned)


def test_small_tools_show_their_whole_icons(monkeypatch) -> None:
    """Each was half as wide as its button's padding left."""
    seen: list[tuple[float, float]] = []

    def button(icon: str, command: Command, tip: str, side: ImVec2, **_) -> list[Command]:
        padding = imgui.get_style().frame_padding.x
        seen.append((imgui.calc_text_size(icon).x + 2 * padding, side.x))
        return []

    monkeypatch.setattr(tools.widgets, "press", button)
    with context((800, 500)):
        theme.set_up(1.0, "dark")
        frames(lambda at: tools.draw(shown_scene(), at, ImVec2(348, 52), ImVec2(452, 416)), look())
    assert seen and all(taken <= side for taken, side in seen)


def test_kept_edits_are_offered_before_panels() -> None:
    """The inventory covered what they are taken back with."""
    state = after(shown_scene(), keep.OfferEdits(OFFER), take.ShowInventory(True))
    with context((800, 500)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: layout.draw_all(state, seen), look())
        box("##offer")  # is there
        order = [window.name for window in imgui.get_current_context().windows]
    assert order.index("##offer") > max(order.index(name) for name in order if "nventory" in name)


RULES = edited(floaters=replace(Floaters(bytes(4 * 12_300)), open=True))
OFFER = Offer(Path("x.edits"), "living_room_left.langflash", 13, datetime(2026, 11, 25))


IN_HAND = {
    "nothing": after(edited(), edit.Deselect()),
    "clone": edited(tool=Tool.CLONE, source=(0.0, 0.0, 1.0)),
    "floaters": edited(floaters=Floaters(bytes(4 * 12_300))),
    "hiding": edited(hiding=Hiding("blur")),
    "brush and hiding": edited(tool=Tool.BRUSH, hiding=Hiding("blur")),
}


@pytest.mark.parametrize("scale", [1.0, 1.5])
@pytest.mark.parametrize("state", IN_HAND.values(), ids=IN_HAND)
def test_key_frames_and_axes_stand_below_the_bars(monkeypatch, state: State, scale: float) -> None:
    """Key frames were before the buttons that hide for good, or do not; axes were behind them."""
    monkeypatch.setattr(layout.canvas, "draw", lambda state, look: [])  # needs OpenGL
    state = after(state, film.AddKey(), film.AddKey())
    for size in ((1280, 800), (round(800 * scale), round(500 * scale))):
        with context(size):
            theme.set_up(scale, "dark")
            frames(lambda seen: layout.draw_all(state, seen), look(scale), 8)
            keys, axes = box("##keys"), window_box("##axes")
            assert keys[2] <= size[0] and not any(overlap(keys, bar) for bar in bars())
            if axes is None:  # there is no room above the viewpoints
                assert max(bar[3] for bar in bars()) > box("##views")[1] - 100 * scale
            else:
                assert not any(overlap(axes, other) for other in (keys, box("##views"), *bars()))


@pytest.mark.parametrize(("size", "scale"), [((800, 500), 1.0), ((1280, 800), 1.5), ((1280, 800), 1.0)])
@pytest.mark.parametrize("state", IN_HAND.values(), ids=IN_HAND)
def test_kept_edits_are_offered_beside_the_tools_and_their_bars(
    monkeypatch, state: State, size: tuple[int, int], scale: float
) -> None:
    """At 800 x 500 the lower third of the tools was behind it, undo among them, and the bar that hides."""
    monkeypatch.setattr(layout.canvas, "draw", lambda state, look: [])  # needs OpenGL
    with context(size):
        theme.set_up(scale, "dark")
        frames(lambda seen: layout.draw_all(after(state, keep.OfferEdits(OFFER)), seen), look(scale), 8)
        offer = window_box("##offer")
        lowest = max((bar[3] for bar in bars()), default=0.0)
        others = [box("##tools"), box("##views"), *bars()]
    assert offer is None or not any(overlap(offer, other) for other in others)
    if offer is None:  # it waits where there is no room alone
        assert lowest > 0.48 * size[1], "the offer, the viewpoints and the status take the other half"
    else:
        assert offer[0] >= 348 * scale and offer[2] <= size[0]


def test_in_the_empty_window_kept_edits_are_offered_above_what_can_be_opened(
    monkeypatch, items: Items
) -> None:
    """It stood before the tile of the very scene that it is about."""
    project = Kept(scene="/rooms/living_room_left.langflash", when=datetime(2026, 11, 25))
    state = State().with_recovery(projects=(project,))
    with context((800, 500)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: layout.draw_all(after(state, keep.OfferEdits(OFFER)), seen), look(), 6)
        offer = box("##offer")
        words = ("##project", "##forget", "##sample", "Photos ...", "Paste")
        opening = {
            name: places for name, places in items.now().items() if any(word in name for word in words)
        }
    assert len(opening) >= 6
    covered = [name for name, places in opening.items() for x0, y0, x1, y1 in places
               if overlap(offer, (x0, y0, x1, y1))]  # fmt: skip
    assert covered == []


def test_a_scene_without_a_picture_yet_invites_nobody_to_drop_photos(items: Items) -> None:
    """A click meant for the room opened the dialog for photos instead."""
    with context((800, 500)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: layout.draw_all(shown_scene(), seen), look(), 6)
        invited = {"welcome", "Paste"} & {name.split("  ")[-1] for name in items.now()}
    assert not invited


@pytest.mark.parametrize(
    ("size", "scale"), [((800, 500), 0.75), ((800, 500), 1.0), ((800, 500), 2.0), ((1280, 800), 2.0)]
)
@pytest.mark.parametrize("dialog", list(Dialog), ids=lambda dialog: dialog.name)
def test_no_dialog_scrolls_sideways(dialog: Dialog, size: tuple[int, int], scale: float) -> None:
    """The help's second column, a fifth of the preferences and Cancel were out of sight."""
    state = replace(edited(), dialog=dialog)
    with context(size):
        theme.set_up(scale, "dark")
        frames(lambda seen: dialogs.draw(state, seen), look(scale), 8)
        window = imgui.internal.find_window_by_name(dialog.value)
        assert window is not None and window.scroll_max.x == 0
        assert window.size.x <= size[0] and window.size.y <= size[1]


def test_the_help_is_scrolled_by_the_keys() -> None:
    state = replace(edited(), dialog=Dialog.HELP)
    with context((800, 500)):
        theme.set_up(1.0, "dark")
        hands = Hands(lambda seen: dialogs.draw(state, seen))
        hands.frames(6)
        window = imgui.internal.find_window_by_name(Dialog.HELP.value)
        assert window is not None and window.scroll_max.y > 0
        hands.key(imgui.Key.down_arrow)
        assert 0 < window.scroll.y < window.scroll_max.y
        hands.key(imgui.Key.end)
        assert window.scroll.y == window.scroll_max.y
        hands.key(imgui.Key.home)
        assert window.scroll.y == 0


def test_the_words_of_a_box_go_on_below_and_can_be_clicked() -> None:
    words = "Keep to what the photos saw: orbits slow down, and the rest fades"
    seen: list[tuple[bool, bool]] = []

    def panel(_look: Look) -> list[Command]:
        imgui.set_next_window_pos(ImVec2(0, 0))
        imgui.set_next_window_size(ImVec2(260, 200))
        imgui.begin("narrow")
        seen.append(widgets.worded_checkbox(words, True))
        assert imgui.get_item_rect_max().x <= 260
        assert imgui.get_item_rect_size().y > 2 * imgui.get_text_line_height()
        imgui.end()
        return []

    with context((800, 500)):
        theme.set_up(1.0, "dark")
        hands = Hands(panel)
        hands.frames(3)
        hands.click(120, 60)
    assert (True, False) in seen


@pytest.mark.parametrize("name", ["Tour", "Rules"])
@pytest.mark.parametrize(("size", "scale"), [((800, 500), 1.0), ((1200, 750), 1.5), ((1280, 800), 1.0)])
def test_a_tour_and_rules_leave_the_view_to_see_that_they_are_about(
    monkeypatch, size: tuple[int, int], scale: float, name: str
) -> None:
    """At 800 x 500 they covered the picture, the photos' strip, what a note is pinned to and what goes."""
    monkeypatch.setattr(layout.canvas, "draw", lambda state, look: [])  # needs OpenGL
    states = {"Tour": after(shown_scene(), tour.ShowTour(True), tour.AddStop()), "Rules": RULES}
    with context(size):
        theme.set_up(scale, "dark")
        frames(lambda seen: layout.draw_all(states[name], seen), look(scale), 6)
        left, top, right, bottom = box(name)
        views, side = box("##views"), box("##panel")
    assert left >= 0 and top >= 0 and right <= size[0] and bottom <= size[1]
    if left < 348 * scale:  # halves of the panel's lines looked out above and below it
        assert left <= side[0] and top <= side[1] and right >= side[2] - 1 and bottom >= side[3]
    covered = max(0.0, right - max(left, 348 * scale)) / (size[0] - 348 * scale)
    assert covered < 0.4 and not overlap((left, top, right, bottom), views)


def test_the_dictionary_has_room_for_its_groups_beside_a_narrow_picture(monkeypatch) -> None:
    """At 800 x 500 it lay over the picture's tools, and showed one group and a half."""
    monkeypatch.setattr(layout.canvas, "draw", lambda state, look: [])  # needs OpenGL
    state = shown_scene()
    state = replace(state, preferences=replace(state.preferences, dictionary_open=True))
    with context((800, 500)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: layout.draw_all(state, seen), look(), 6)
        _left, top, right, bottom = box("Dictionary")
    assert right <= 348 and bottom - top > 400


def test_warnings_leave_room_for_the_field_of_phrases(monkeypatch, items: Items) -> None:
    """Five of them stood above it, and what was typed chose tools."""
    state = edited()
    assert state.scene.info is not None
    said = tuple(f"{number}: " + "what helps is to take more photos of the room, with more light. " * 2
                 for number in range(5))  # fmt: skip
    state = state.with_scene(info=replace(state.scene.info, warnings=said))
    state = state.with_asking(prompts=(replace(state.asking.prompts[0], text=""),))
    monkeypatch.setattr(layout.canvas, "draw", lambda state, look: [])  # needs OpenGL
    with context((900, 560)):
        theme.set_up(1.0, "dark")
        frames(lambda seen: layout.draw_all(state, seen), look(), 8)
        ((_, _, _, bottom),) = items.now()["##text"]
    assert bottom < 560 - theme.STATUS_HEIGHT
