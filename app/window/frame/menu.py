"""The menu behind the button in the upper right: files, samples, preferences, help."""

from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from .. import commands as do
from ..kit.look import Look
from ..recovery import commands as keep
from ..scene import commands as show
from ..scene import samples
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
    issued += _samples()
    imgui.separator()
    issued += _named(state, "Save ...", "Export ...", "Merge a scene into this one ...")
    imgui.separator()
    issued += _named(state, "All commands", "Preferences", "Log", "Mouse and keys")
    imgui.separator()
    issued += _named(state, "Leave")
    imgui.end_popup()
    return issued


def _named(state: State, *names: str) -> list[do.Command]:
    """Entries of the table; greyed where there is nothing for them to do."""
    issued: list[do.Command] = []
    for entry in map(table.named, names):
        command = entry.make(state)
        label = f"{entry.icon}   {entry.name}"
        if imgui.menu_item(label, entry.key, False, command is not None)[0] and command is not None:
            issued.append(command)
    return issued


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
                issued.append(
                    show.Instead((show.SetPhotosAside(), show.AddPhotos(photos), show.Reconstruct()))
                )
        imgui.end_menu()
    return issued
