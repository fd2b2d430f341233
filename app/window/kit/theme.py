"""The look: a dark and a light theme, one accent, Roboto with icons, sizes that follow the monitor's
scale."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import imgui_bundle
from imgui_bundle import ImVec2, ImVec4, imgui

from . import fonts

FONT_SIZE = 16.0  # pixels at scale 1
HEADING = 1.12  # of the font size
PANEL_WIDTH = 348.0  # pixels at scale 1
STATUS_HEIGHT = 32.0
_FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"


AXES = (ImVec4(0.93, 0.36, 0.36, 1), ImVec4(0.55, 0.82, 0.35, 1), ImVec4(0.35, 0.60, 0.96, 1))
"""x, y and z of the world, in both themes."""


@dataclass(frozen=True)
class Palette:
    """The colours of one theme. Panels take them by name from this module: `theme.TEXT`."""

    TEXT: ImVec4
    MUTED: ImVec4
    ACCENT: ImVec4
    GOOD: ImVec4
    BAD: ImVec4
    CANVAS: ImVec4
    PANEL: ImVec4
    RAISED: ImVec4
    HOVER: ImVec4
    PRESSED: ImVec4
    LINE: ImVec4
    SELECTED: ImVec4
    POPUP: ImVec4
    ON_ACCENT: ImVec4
    LINK: ImVec4


DARK = Palette(
    TEXT=ImVec4(0.90, 0.91, 0.93, 1.0),
    MUTED=ImVec4(0.58, 0.61, 0.66, 1.0),
    ACCENT=ImVec4(0.96, 0.62, 0.16, 1.0),
    GOOD=ImVec4(0.40, 0.80, 0.53, 1.0),
    BAD=ImVec4(0.95, 0.45, 0.42, 1.0),
    CANVAS=ImVec4(0.055, 0.060, 0.070, 1.0),
    PANEL=ImVec4(0.098, 0.106, 0.122, 1.0),
    RAISED=ImVec4(0.150, 0.161, 0.184, 1.0),
    HOVER=ImVec4(0.205, 0.220, 0.250, 1.0),
    PRESSED=ImVec4(0.255, 0.272, 0.310, 1.0),
    LINE=ImVec4(0.200, 0.213, 0.240, 1.0),
    SELECTED=ImVec4(0.36, 0.68, 1.0, 1.0),  # near the tint of selected Gaussians
    POPUP=ImVec4(0.125, 0.135, 0.155, 1.0),
    ON_ACCENT=ImVec4(0.10, 0.07, 0.02, 1.0),
    LINK=ImVec4(0.45, 0.72, 0.98, 1.0),
)
LIGHT = Palette(  # text on every ground at 4.5 : 1 or more (WCAG AA); the picture's ground stays dark
    TEXT=ImVec4(0.11, 0.12, 0.14, 1.0),
    MUTED=ImVec4(0.36, 0.38, 0.42, 1.0),
    ACCENT=ImVec4(0.93, 0.58, 0.12, 1.0),
    GOOD=ImVec4(0.05, 0.45, 0.20, 1.0),
    BAD=ImVec4(0.75, 0.15, 0.12, 1.0),
    CANVAS=ImVec4(0.89, 0.90, 0.92, 1.0),
    PANEL=ImVec4(0.965, 0.968, 0.975, 1.0),
    RAISED=ImVec4(0.895, 0.902, 0.915, 1.0),
    HOVER=ImVec4(0.840, 0.850, 0.868, 1.0),
    PRESSED=ImVec4(0.780, 0.792, 0.815, 1.0),
    LINE=ImVec4(0.820, 0.830, 0.848, 1.0),
    SELECTED=ImVec4(0.05, 0.40, 0.78, 1.0),
    POPUP=ImVec4(0.985, 0.988, 0.992, 1.0),
    ON_ACCENT=ImVec4(0.10, 0.07, 0.02, 1.0),
    LINK=ImVec4(0.06, 0.36, 0.68, 1.0),
)
THEMES = {"dark": DARK, "light": LIGHT}
_chosen: dict[str, Any] = {"palette": DARK, "scale": 1.0}


def __getattr__(name: str) -> ImVec4:
    """A colour of the theme in force, by its name in `Palette`."""
    try:
        return getattr(_chosen["palette"], name)
    except AttributeError:
        raise AttributeError(f"theme has no {name}") from None


def set_up(scale: float, name: str = "dark") -> None:
    """Fonts and style of the current ImGui context; `scale` is the interface's, 1 at 96 dpi."""
    io = imgui.get_io()
    io.set_ini_filename("")  # the program's own preferences remember the layout
    io.config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
    imgui.get_current_context().config_nav_windowing_key_next = 0  # Ctrl+Tab: ours have no names
    imgui.get_current_context().config_nav_windowing_key_prev = 0
    io.fonts.add_font_from_file_ttf(str(_FONTS / "Roboto" / "Roboto-Regular.ttf"), FONT_SIZE)
    icons = imgui.ImFontConfig()
    icons.merge_mode = True
    icons.glyph_min_advance_x = FONT_SIZE
    icons.glyph_offset = ImVec2(0.0, 1.0)
    icon_file = _FONTS / "Font_Awesome_6_Free-Solid-900.otf"
    io.fonts.add_font_from_file_ttf(str(icon_file), FONT_SIZE * 0.85, icons)
    for file in fonts.fallbacks():
        further = imgui.ImFontConfig()
        further.merge_mode = True
        io.fonts.add_font_from_file_ttf(str(file), FONT_SIZE, further)
    style = imgui.get_style()
    _sizes(style)
    _chosen["scale"] = 1.0
    restyle(scale, name)


def restyle(scale: float, name: str) -> None:
    """Another theme, or another scale of the interface."""
    _chosen["palette"] = THEMES[name]
    style = imgui.get_style()
    if name == "light":
        imgui.style_colors_light()
    else:
        imgui.style_colors_dark()
    _colours(style)
    if scale != _chosen["scale"]:
        style.scale_all_sizes(scale / _chosen["scale"])
        _chosen["scale"] = scale
    style.font_scale_dpi = scale


def _sizes(style: imgui.Style) -> None:
    style.window_padding = ImVec2(16, 14)
    style.frame_padding = ImVec2(10, 6)
    style.item_spacing = ImVec2(8, 8)
    style.item_inner_spacing = ImVec2(8, 6)
    style.window_rounding = style.child_rounding = 0.0
    style.popup_rounding = 8.0
    style.frame_rounding = style.grab_rounding = 6.0
    style.scrollbar_size = 10.0
    style.scrollbar_rounding = 6.0
    style.grab_min_size = 8.0
    style.window_border_size = style.frame_border_size = 0.0
    style.popup_border_size = style.tab_bar_border_size = style.tab_bar_overline_size = 1.0
    style.tab_rounding = 6.0


def _colours(style: imgui.Style) -> None:
    col = imgui.Col_
    clear = ImVec4(0, 0, 0, 0)
    p = _chosen["palette"]
    accent_soft = ImVec4(p.ACCENT.x, p.ACCENT.y, p.ACCENT.z, 0.35)
    grab = ImVec4(p.ACCENT.x, p.ACCENT.y, p.ACCENT.z, 0.8)
    table = {
        col.text: p.TEXT, col.text_disabled: p.MUTED, col.window_bg: p.PANEL, col.child_bg: clear,
        col.popup_bg: p.POPUP, col.border: p.LINE, col.separator: p.LINE,
        col.frame_bg: p.RAISED, col.frame_bg_hovered: p.HOVER, col.frame_bg_active: p.HOVER,
        col.button: p.RAISED, col.button_hovered: p.HOVER, col.button_active: p.PRESSED,
        col.header: p.RAISED, col.header_hovered: p.HOVER, col.header_active: p.PRESSED,
        col.slider_grab: grab, col.slider_grab_active: p.ACCENT, col.check_mark: p.ACCENT,
        col.plot_histogram: p.ACCENT, col.text_selected_bg: accent_soft, col.nav_cursor: p.ACCENT,
        col.scrollbar_bg: clear, col.scrollbar_grab: p.HOVER, col.scrollbar_grab_hovered: p.PRESSED,
        col.scrollbar_grab_active: p.PRESSED, col.modal_window_dim_bg: ImVec4(0, 0, 0, 0.55),
        col.title_bg: p.PANEL, col.title_bg_active: p.PANEL, col.input_text_cursor: p.ACCENT,
        col.tab: clear, col.tab_hovered: p.HOVER, col.tab_selected: p.RAISED, col.tab_dimmed: clear,
        col.tab_dimmed_selected: p.RAISED, col.tab_selected_overline: p.ACCENT,
        col.tab_dimmed_selected_overline: p.ACCENT, col.drag_drop_target: p.ACCENT,
        col.resize_grip: p.LINE, col.resize_grip_hovered: p.ACCENT, col.resize_grip_active: p.ACCENT,
        col.separator_hovered: p.ACCENT, col.separator_active: p.ACCENT,
    }  # fmt: skip
    for which, colour in table.items():
        style.set_color_(which, colour)
