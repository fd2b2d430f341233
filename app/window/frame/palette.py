"""The command palette: every command with its key, narrowed down by typing, run by Enter."""

from imgui_bundle import ImVec2, imgui

from .. import commands as do
from ..kit import theme, widgets
from ..kit.look import Look
from ..state import State
from . import table

WIDTH = 520.0  # design pixels
_ROWS = 11.5  # shown at once; the half tells that there are more
_FLAGS = imgui.InputTextFlags_.callback_history  # keeps Up and Down from leaving the field


def draw(state: State, look: Look) -> list[do.Command]:
    """The dialog's body."""
    found = table.matching(state.palette.text, state)
    place = min(state.palette.place, max(len(found) - 1, 0))
    text, step, entered = _field(state.palette.text)
    wanted = do.Palette(text, min(max(place + step, 0), max(len(found) - 1, 0)))
    if text != state.palette.text:
        wanted = do.Palette(text)
    issued: list[do.Command] = [] if wanted == state.palette else [do.EditPalette(wanted)]
    issued += _list(state, found, wanted.place, bool(step), look)
    if entered and found:
        issued += _run(state, found[place])
    return issued


def _field(text: str) -> tuple[str, int, bool]:
    """What is typed, by how much an arrow moves the choice, and whether Enter was pressed."""
    if imgui.is_window_appearing():
        imgui.set_keyboard_focus_here()
    imgui.set_next_item_width(-1)
    _, text = imgui.input_text_with_hint("##command", "type a command", text, _FLAGS, lambda _: 0)
    entered = widgets.confirmed()
    down, up = (imgui.is_key_pressed(key) for key in (imgui.Key.down_arrow, imgui.Key.up_arrow))
    return text, int(down) - int(up), entered


def _list(
    state: State, found: tuple[table.Entry, ...], place: int, moved: bool, look: Look
) -> list[do.Command]:
    """The commands that fit; a click runs one."""
    issued: list[do.Command] = []
    widgets.gap(look.px(2))
    imgui.begin_child("##commands", ImVec2(0, _ROWS * imgui.get_text_line_height_with_spacing()))
    for row, entry in enumerate(found):
        imgui.begin_disabled(entry.make(state) is None)
        with widgets.colours(header=theme.PRESSED):
            pressed = imgui.selectable(f"{entry.name}##{row}", row == place)[0]
        if pressed:
            issued += _run(state, entry)
        if row == place and moved:
            imgui.set_scroll_here_y(0.5)
        with widgets.colours(text=theme.MUTED):
            imgui.same_line(look.px(300))
            imgui.text(entry.group)
            widgets.at_right_edge(", ".join(map(str, entry.keys)))
        imgui.end_disabled()
    if not found:
        widgets.muted("No matching command.")
    imgui.end_child()
    return issued


def _run(state: State, entry: table.Entry) -> list[do.Command]:
    """Close the palette and do it; nothing where it has nothing to do."""
    command = entry.make(state)
    return [] if command is None else [do.ShowDialog(None), command]
