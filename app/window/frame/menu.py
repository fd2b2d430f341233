"""The menu behind the button in the upper right: files, samples, preferences, help."""

from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from .. import commands as do
from ..exporting import commands as export
from ..kit.look import Look
from ..recovery import commands as keep
from ..scene import commands as show
from ..scene import samples
from ..state import State


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
    issued: list[do.Command] = []
    shown = state.info is not None
    issued += _item(fa.ICON_FA_FOLDER_OPEN, "Open ...", "Ctrl+O", do.ShowDialog("open"))
    issued += _recent(state)
    issued += _samples()
    imgui.separator()
    issued += _item(fa.ICON_FA_FLOPPY_DISK, "Save ...", "Ctrl+S", do.ShowDialog("save"), shown)
    issued += _item(fa.ICON_FA_FILE_EXPORT, "Export ...", "Ctrl+E", export.ShowExport(), shown)
    imgui.separator()
    issued += _item(fa.ICON_FA_GEAR, "Preferences", "Ctrl+P", do.ShowDialog("settings"))
    issued += _item(fa.ICON_FA_LIST, "Log", "F2", do.ShowDialog("log"))
    issued += _item(fa.ICON_FA_KEYBOARD, "Mouse and keys", "F1", do.ShowDialog("help"))
    imgui.separator()
    issued += _item(fa.ICON_FA_RIGHT_FROM_BRACKET, "Leave", "Ctrl+Q", do.Leave())
    imgui.end_popup()
    return issued


def _item(icon: str, label: str, key: str, command: do.Command, enabled: bool = True) -> list[do.Command]:
    pressed = imgui.menu_item(f"{icon}   {label}", key, False, enabled)[0]
    return [command] if pressed else []


def _recent(state: State) -> list[do.Command]:
    issued: list[do.Command] = []
    recent = state.preferences.recent
    if imgui.begin_menu(f"{fa.ICON_FA_CLOCK_ROTATE_LEFT}   Recent scenes", bool(recent)):
        for place, path in enumerate(recent):
            if imgui.menu_item(f"{Path(path).name}##{place}", "", False, True)[0]:
                issued.append(show.OpenPaths((path,)))
            if imgui.is_item_hovered():
                imgui.set_tooltip(path)
        imgui.separator()
        if imgui.menu_item("Forget these", "", False, True)[0]:
            issued.append(keep.ForgetRecent())
        imgui.end_menu()
    return issued


def _samples() -> list[do.Command]:
    issued: list[do.Command] = []
    if imgui.begin_menu(f"{fa.ICON_FA_IMAGES}   Sample photos", True):
        for label, photos in samples.pairs():
            if imgui.menu_item(label, "", False, True)[0]:
                issued += [show.ClearPhotos(), show.OpenPaths(tuple(map(str, photos))), show.Reconstruct()]
        imgui.end_menu()
    return issued
