"""The menu behind the button in the upper right: files, samples, preferences, help."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from .. import commands as do
from ..kit.look import Look
from ..recovery import commands as keep
from ..state import State
from . import table


def draw(state: State, look: Look) -> list[do.Command]:
    """The button and its menu."""
    if imgui.button(fa.ICON_FA_BARS):
        imgui.open_popup("menu")
    corner = ImVec2(imgui.get_item_rect_max().x, imgui.get_item_rect_max().y + look.px(6))
    imgui.set_next_window_pos(corner, imgui.Cond_.appearing, ImVec2(1, 0))
    imgui.push_style_var(imgui.StyleVar_.window_padding, look.vec(12, 10))
    issued = _items(state) if imgui.begin_popup("menu") else []
    imgui.pop_style_var()
    return issued


def _items(state: State) -> list[do.Command]:
    issued = _named(state, "Open ...")
    issued += _recent(state)
    issued += _samples(state)
    imgui.separator()
    issued += _named(state, "Save ...", "Export ...", "Merge a scene into this one ...")
    issued += _named(state, "Level the scene")
    imgui.separator()
    issued += _named(state, "All commands", "Preferences", "Log", "Mouse and keys")
    imgui.separator()
    issued += _named(state, "Quit")
    imgui.end_popup()
    return issued


def _named(state: State, *names: str) -> list[do.Command]:
    """Entries of the table by their names."""
    entries = map(table.named, names)
    return [c for entry in entries for c in _entry(state, entry, f"{entry.icon}   {entry.name}")]


def _entry(state: State, entry: table.Entry, label: str) -> list[do.Command]:
    """One line; greyed where there is nothing for it to do."""
    command = entry.make(state)
    pressed = imgui.menu_item(label, entry.key, False, command is not None)[0]
    return [command] if pressed and command is not None else []


def _recent(state: State) -> list[do.Command]:
    issued: list[do.Command] = []
    paths = state.preferences.recent
    if imgui.begin_menu(f"{fa.ICON_FA_CLOCK_ROTATE_LEFT}   Recent scenes", bool(paths)):
        for path, entry in zip(paths, table.recent(state), strict=True):
            issued += _entry(state, entry, f"{entry.name}##{path}")
            if imgui.is_item_hovered():
                imgui.set_tooltip(path)
        imgui.separator()
        if imgui.menu_item("Forget these", "", False, True)[0]:
            issued.append(keep.ForgetRecent())
        imgui.end_menu()
    return issued


def _samples(state: State) -> list[do.Command]:
    issued: list[do.Command] = []
    if imgui.begin_menu(f"{fa.ICON_FA_IMAGES}   Sample photos", True):
        for entry in table.sample_photos():
            issued += _entry(state, entry, entry.name)
        imgui.end_menu()
    return issued
