"""What the picture shows: the usual modes as buttons, all of them in a menu."""

from itertools import accumulate

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.base import pictures
from langflash_core.base.pictures import GROUPS, KEYED, MISSING, PICTURES, Picture, in_group

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import camera
from ..state import possible

USUAL = tuple(picture for picture in PICTURES if picture.usual)
_RESTING = imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled
_MENU = 296.0  # design pixels wide


def draw(state: State, look: Look, room: float) -> list[do.Command]:
    """Buttons for as many of the usual modes as `room` (interface pixels) has, and the menu."""
    issued: list[do.Command] = []
    imgui.begin_disabled(state.scene.info is None)
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(4, 0))
    shown = _fitting(look, room)
    for mode in shown:
        tip, chosen = f"{mode.tip}{_key(mode)}", state.scene.mode is mode
        if widgets.press(mode.label, None, tip, on=chosen):
            issued.append(camera.SetMode(mode))
        imgui.same_line()
    named = state.scene.mode not in shown
    label = f"{state.scene.mode.label if named else 'More'}  {fa.ICON_FA_CARET_DOWN}###menu"
    if widgets.press(label, None, on=named):
        imgui.open_popup("modes")
    corner = ImVec2(imgui.get_item_rect_min().x, imgui.get_item_rect_max().y + look.px(6))
    imgui.pop_style_var()
    imgui.end_disabled()
    imgui.set_next_window_pos(corner, imgui.Cond_.appearing)
    imgui.push_style_var(imgui.StyleVar_.window_padding, look.vec(12, 10))
    if imgui.begin_popup("modes"):
        issued += _menu(state, look)
        imgui.end_popup()
    imgui.pop_style_var()
    return issued


def _fitting(look: Look, room: float) -> tuple[Picture, ...]:
    padding = 2 * imgui.get_style().frame_padding.x + look.px(4)
    menu = imgui.calc_text_size(f"{pictures.TRANSMITTANCE.label}  {fa.ICON_FA_CARET_DOWN}").x + padding
    ends = accumulate(imgui.calc_text_size(mode.label).x + padding for mode in USUAL)
    return tuple(mode for mode, end in zip(USUAL, ends, strict=True) if end <= room - menu)


def _menu(state: State, look: Look) -> list[do.Command]:
    """Every mode with what it means; what the scene has no data for is greyed."""
    issued: list[do.Command] = []
    for place, title in enumerate(GROUPS):
        if place:
            widgets.gap(look.px(2))
        imgui.text_colored(theme.MUTED, title)
        for mode in in_group(title):
            there = possible(mode, state.scene.info)
            imgui.begin_disabled(not there)
            if imgui.selectable(f"##{mode.name}", False, 0, ImVec2(look.px(_MENU - 24), 0))[0]:
                issued.append(camera.SetMode(mode))
            hovered = imgui.is_item_hovered(_RESTING)
            if state.scene.mode is mode:
                imgui.same_line(look.px(12))
                imgui.text(fa.ICON_FA_CHECK)
            imgui.same_line(look.px(36))
            imgui.text(mode.label)
            imgui.end_disabled()
            if hovered:
                imgui.set_tooltip(mode.tip if there else MISSING[mode.needs])
            key = _key(mode).strip(" ()")
            imgui.same_line(look.px(_MENU) - look.px(14) - imgui.calc_text_size(key).x)
            imgui.text_colored(theme.MUTED, key)
    return issued


def _key(mode: Picture) -> str:
    return f"  ({(KEYED.index(mode) + 1) % 10})" if mode in KEYED else ""
