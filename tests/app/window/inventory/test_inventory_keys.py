"""The inventory by the keyboard alone: from row to row, to a thing, to its name and to the files."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from imgui_bundle import imgui

from app.window import commands as do
from app.window.dialogs import Dialog
from app.window.editing import pointing as point
from app.window.editing.state import Floaters, Tool
from app.window.exporting import commands as export
from app.window.frame import keys, layout
from app.window.inventory import commands as take
from app.window.inventory.state import Row
from app.window.kit import theme
from app.window.state import State
from langflash_core.base.outputs import ROOM
from langflash_core.scene.mask import Mask
from tests.app.window.headless import context, look
from tests.app.window.scenes import after
from tests.app.window.test_small_windows import edited
from tests.app.window.test_stumbles import Hands

_SIZES = ((1280, 800), (800, 500))
_NAMES = ("chair 1", "chair 2", "desk 1", "desk 2", "desk 3", "lamp 1", "lamp 2", "vase 1", "vase 2")
KEY = imgui.Key


def listed() -> State:
    """More things than the panel shows at once."""
    nothing = Mask.first(12_300, 5), np.zeros((8, 3))
    rows = tuple(
        Row(name, name[:-2], 0.9, (1.0, 0.0, 2.0), (1.0, 1.0, 1.0), 0.0, (0,), False, *nothing)
        for name in _NAMES
    )
    return after(edited(), take.ShowInventory(True), take.Listed(rows, "m", None))


class Keys(Hands):
    """The whole window; the last of `states` is shown."""

    def __init__(self, states: list[State]) -> None:
        super().__init__(lambda seen: layout.draw_all(states[-1], seen)[0])

    def press(self, *keys: imgui.Key, held: imgui.Key | None = None) -> list[do.Command]:
        """What the last one issued."""
        if held is not None:
            imgui.get_io().add_key_event(held, True)
        for key in keys:
            self.issued.clear()
            self.key(key)
        if held is not None:
            imgui.get_io().add_key_event(held, False)
            self.frames()
        return list(self.issued)

    def to_area(self, name: str) -> None:
        for _ in range(20):
            self.press(KEY.f6)
            if area() == name:
                return
        raise AssertionError(f"F6 does not come to {name}")

    def here(self) -> str:
        """The thing that Enter leads to."""
        (command,) = self.press(KEY.enter)
        assert isinstance(command, take.ChooseThing) and command.combine == "replace"
        return command.id


def area() -> str:
    window = imgui.get_current_context().nav_window
    return "" if window is None else window.root_window.name


@contextmanager
def keyboard(size: tuple[int, int], monkeypatch, states: list[State]) -> Iterator[Keys]:
    monkeypatch.setattr(layout.canvas, "draw", lambda state, look: [])  # needs OpenGL
    with context(size):
        theme.set_up(1.0, "dark")
        hands = Keys(states)
        hands.look = look()
        hands.frames(5)
        yield hands


@pytest.mark.parametrize("size", _SIZES)
def test_up_and_down_walk_row_by_row_and_enter_leads_there(size: tuple[int, int], monkeypatch) -> None:
    """They went from the picture to the name, and to the words of the same row."""
    with keyboard(size, monkeypatch, [listed()]) as hands:
        hands.to_area("Inventory")
        walked = [hands.here()]
        for _ in _NAMES[1:]:
            hands.press(KEY.down_arrow)
            walked.append(hands.here())
        assert walked == list(_NAMES)
        hands.press(KEY.up_arrow)
        assert hands.here() == _NAMES[-2]
        hands.press(KEY.home)
        assert hands.here() == _NAMES[0]
        (more,) = hands.press(KEY.enter, held=KEY.mod_shift)
        assert isinstance(more, take.ChooseThing) and more.combine == "add"


@pytest.mark.parametrize("size", _SIZES)
def test_tab_goes_to_the_name_of_the_row_and_past_it(size: tuple[int, int], monkeypatch) -> None:
    with keyboard(size, monkeypatch, [listed()]) as hands:
        hands.to_area("Inventory")
        hands.press(KEY.down_arrow, KEY.tab)
        imgui.get_io().add_input_characters_utf8("by the door")
        hands.frames()
        assert hands.press(KEY.enter) == [take.NameThing("chair 2", "by the door")]
        hands.press(KEY.tab)
        assert hands.here() == "desk 1"
        hands.press(KEY.tab)
        imgui.get_io().add_input_characters_utf8("mine")
        hands.frames()
        assert hands.press(KEY.down_arrow) == [take.NameThing("desk 1", "mine")], "a walk on keeps it too"
        assert hands.here() == "desk 2"


@pytest.mark.parametrize("size", _SIZES)
def test_below_the_last_row_are_the_files(size: tuple[int, int], monkeypatch) -> None:
    with keyboard(size, monkeypatch, [listed()]) as hands:
        hands.to_area("Inventory")
        hands.press(KEY.end, KEY.tab)
        reached = []
        for _ in range(1 + len(ROOM)):  # the first one levels the scene
            hands.press(KEY.tab)
            reached += hands.press(KEY.space)
        assert reached[-len(ROOM) :] == [export.ShowExport(what) for what in ROOM]


def test_f6_goes_on_from_a_row(monkeypatch) -> None:
    """A row lies in a part of the panel of its own: the rules of the clean-up, which come after it, were out
    of reach."""
    both = listed().with_editing(floaters=Floaters(bytes(4 * 12_300), open=True))
    with keyboard((1280, 800), monkeypatch, [both]) as hands:
        hands.to_area("Inventory")
        hands.press(KEY.down_arrow)
        hands.press(KEY.f6)
        assert area() == "Rules"


def test_after_a_dialog_that_esc_closed_keys_go_on_where_they_were(monkeypatch) -> None:
    """They went on in the bar of the selection: Enter turned that inside out."""
    states = [listed()]
    with keyboard((1280, 800), monkeypatch, states) as hands:
        hands.to_area("Inventory")
        hands.press(KEY.down_arrow)
        states.append(replace(states[0], dialog=Dialog.SETTINGS))
        hands.frames(4)
        assert area() == Dialog.SETTINGS.value
        assert hands.press(KEY.escape) == [do.ShowDialog(None)]
        states.append(states[0])
        hands.frames(4)
        hands.press(KEY.down_arrow)
        assert hands.here() == "desk 1"


def test_the_key_of_the_list_works_while_a_name_is_typed(monkeypatch) -> None:
    """It was lost: after a name was given, the list would not go."""
    with keyboard(_SIZES[0], monkeypatch, [listed()]) as hands:
        hands.to_area("Inventory")
        hands.press(KEY.tab)
        assert keys.typing()
        assert take.ShowInventory(False) in hands.press(KEY.l, held=KEY.mod_ctrl)


def test_escape_closes_the_list_last(monkeypatch) -> None:
    states = [listed().with_editing(tool=Tool.LASSO)]
    with keyboard(_SIZES[0], monkeypatch, states) as hands:
        assert hands.press(KEY.escape) == [point.SetTool(Tool.MOVE)]
        states.append(listed())
        hands.frames(2)
        assert hands.press(KEY.escape) == [take.ShowInventory(False)]
