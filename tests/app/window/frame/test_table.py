"""The one table of commands, without a window."""

from dataclasses import replace
from pathlib import Path

import pytest
from imgui_bundle import imgui

from app.window.commands import Command
from app.window.dialogs import Dialog
from app.window.editing import commands as edit
from app.window.frame import dialogs, keys, table
from app.window.kit import theme
from app.window.recovery import commands as keep
from app.window.state import State
from app.window.touring import commands as tour
from langflash_core.base import pictures
from langflash_core.scene.edits import Mask
from tests.app.window import headless
from tests.app.window.scenes import after, shown_scene


def test_names_and_keys_are_each_given_once() -> None:
    names = [entry.name for entry in table.ENTRIES]
    keys = [str(chord) for entry in table.ENTRIES for chord in entry.keys]
    assert len(set(names)) == len(names) and len(set(keys)) == len(keys)
    assert {"Ctrl+F", "Ctrl+P", "Ctrl+Shift+Z", "Ctrl+,", "F1", "[", "1", "0", "Del", "Home"} <= set(keys)


def test_every_group_is_in_the_help() -> None:
    shown = {group for column in dialogs.COLUMNS for group in column if group}
    assert shown == {entry.group for entry in table.ENTRIES}


@pytest.mark.parametrize("entry", table.ENTRIES, ids=lambda entry: entry.name)
def test_every_command_is_found_by_its_name_and_does_something_or_says_no(entry: table.Entry) -> None:
    assert entry in table.matching(entry.name.upper(), State())
    assert table.named(entry.name) is entry
    for state in (State(), shown_scene()):
        command = entry.make(state)
        assert command is None or isinstance(after(state, command), State)


def found(text: str, state: State = State()) -> list[str]:  # noqa: B008
    """Names and groups, in the order of the palette."""
    return [f"{entry.name} ({entry.group})" for entry in table.matching(text, state)]


def test_words_narrow_down_in_any_order() -> None:
    assert table.matching("", State())[: len(table.ENTRIES)] == table.ENTRIES
    assert found("map heat") == [f"Show: {pictures.HEAT.label} (View)"]
    assert {entry.group for entry in table.matching("tools", State())} == {"Tools"}
    assert found("sel")[0].startswith("Sel")  # before "Delete the selection"
    assert found("no such thing") == []


def test_the_palette_opens_samples_and_recent_scenes() -> None:
    """By keys, from anywhere: tiles stand in the empty window alone."""
    assert found("sample desk") == ["Desk (Sample photos)"]
    assert found("recent") == []
    begun = after(State(), *(keep.Opened(Path(f"/rooms/{name}.langflash")) for name in ("hall", "den")))
    assert found("recent", begun) == ["den.langflash (Recent scenes)", "hall.langflash (Recent scenes)"]
    (hall,) = table.matching("hall", begun)
    assert hall.make(begun) == keep.OpenProject(str(Path("/rooms/hall.langflash")))


def made(name: str, state: State) -> Command | None:
    return table.named(name).make(state)


def test_what_has_nothing_to_do_says_so() -> None:
    empty, state = State(), shown_scene()
    assert made("Save ...", empty) is None and made("Undo", state) is None
    assert made("Delete the selection", state) is None and made("Show: Agreement", state) is None
    count = state.editing.marks.deleted.count  # type: ignore[union-attr]
    selected = after(state, edit.Found(Mask.full(count), "replace", "here"))
    assert made("Delete the selection", selected) == edit.Delete()
    assert made("Undo", selected) == edit.Undo() and made("Redo", selected) is None
    assert made("Redo", after(selected, edit.Undo())) == edit.Redo()


def test_help_fits_a_window_of_800_lines() -> None:
    shown = replace(State(), dialog=Dialog.HELP)
    with headless.context((1280, 800)):
        theme.set_up(1.0)
        headless.frames(lambda look: dialogs.draw(shown, look), headless.look(), 5)
        window = imgui.internal.find_window_by_name(Dialog.HELP.value)
        assert window is not None and window.scroll_max.y == 0
    assert ("1 to 0", "Show: RGB to Features") in dialogs.help_rows("View")
    assert ("Ctrl+Z", "Undo") in dialogs.help_rows("Edit")
    assert ("Comma, Num 5", "Parallel rays (orthographic), or perspective") in dialogs.help_rows("View")
    turns = [keys for keys, meaning in dialogs.help_rows("View") if meaning.startswith("Orbit")]
    assert turns == ["Num 4, 6, 8, 2", "Ctrl+Shift+arrows"], "each kind of key its row"
    assert ("PgDn, PgUp", "Tour: next stop, previous stop") in dialogs.help_rows("View")
    assert ("Ctrl+arrows, PgUp, PgDn", "Nudge the selection") in dialogs.help_rows("Edit")


@pytest.mark.parametrize("scale", [1.0, 1.5])
def test_what_keys_do_stands_beside_them(scale: float, monkeypatch) -> None:
    """The keys of a step around the scene lay under what they do."""
    ends, gaps = list[float](), list[float]()
    real, coloured = imgui.text, imgui.text_colored

    def text(words: str) -> None:
        real(words)
        ends.append(imgui.get_item_rect_max().x)

    def text_colored(colour, words: str) -> None:
        coloured(colour, words)
        if ends:
            gaps.append(imgui.get_item_rect_min().x - ends.pop())

    monkeypatch.setattr(imgui, "text", text)
    monkeypatch.setattr(imgui, "text_colored", text_colored)
    shown = replace(State(), dialog=Dialog.HELP)
    with headless.context((1920, 1200)):
        theme.set_up(scale)
        headless.frames(lambda look: dialogs.draw(shown, look), headless.look(scale), 3)
    assert len(gaps) > 100 and min(gaps) > 0


def test_the_page_keys_of_a_tour_do_not_move_the_focus() -> None:
    """Page down went to the next stop and to another control at once."""
    for state, owned in ((shown_scene(), False), (after(shown_scene(), tour.AddStop()), True)):
        owners = []

        def draw(_look, state=state, owners=owners) -> None:
            keys.draw(state)
            own = imgui.get_id("commands")
            owners.append(imgui.internal.get_key_owner(imgui.Key.page_down) == own)

        with headless.context((400, 300)):
            theme.set_up(1.0, "dark")
            headless.frames(draw, headless.look(), 2)
        assert owners[-1] is owned
