"""The look: dark ground, one accent, Roboto with icons, sizes that follow the monitor's scale."""

from pathlib import Path

import imgui_bundle
from imgui_bundle import ImVec2, ImVec4, imgui

FONT_SIZE = 16.0  # pixels at scale 1
HEADING = 1.12  # of the font size
PANEL_WIDTH = 348.0  # pixels at scale 1
STATUS_HEIGHT = 32.0

TEXT = ImVec4(0.90, 0.91, 0.93, 1.0)
MUTED = ImVec4(0.58, 0.61, 0.66, 1.0)
ACCENT = ImVec4(0.96, 0.62, 0.16, 1.0)
GOOD = ImVec4(0.40, 0.80, 0.53, 1.0)
BAD = ImVec4(0.95, 0.45, 0.42, 1.0)
CANVAS = ImVec4(0.055, 0.060, 0.070, 1.0)
PANEL = ImVec4(0.098, 0.106, 0.122, 1.0)
RAISED = ImVec4(0.150, 0.161, 0.184, 1.0)
HOVER = ImVec4(0.205, 0.220, 0.250, 1.0)
PRESSED = ImVec4(0.255, 0.272, 0.310, 1.0)
SELECTED = ImVec4(0.36, 0.68, 1.0, 1.0)  # near the tint of selected Gaussians
LINE = ImVec4(0.200, 0.213, 0.240, 1.0)
ON_ACCENT = ImVec4(0.10, 0.07, 0.02, 1.0)

_FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"


def set_up(scale: float) -> None:
    """Fonts and style of the current ImGui context; `scale` is the interface's, 1 at 96 dpi."""
    io = imgui.get_io()
    io.set_ini_filename("")  # the layout is fixed; no file is left behind
    io.fonts.add_font_from_file_ttf(str(_FONTS / "Roboto" / "Roboto-Regular.ttf"), FONT_SIZE)
    icons = imgui.ImFontConfig()
    icons.merge_mode = True
    icons.glyph_min_advance_x = FONT_SIZE
    icons.glyph_offset = ImVec2(0.0, 1.0)
    icon_file = _FONTS / "Font_Awesome_6_Free-Solid-900.otf"
    io.fonts.add_font_from_file_ttf(str(icon_file), FONT_SIZE * 0.85, icons)
    imgui.style_colors_dark()
    style = imgui.get_style()
    _sizes(style)
    _colours(style)
    style.scale_all_sizes(scale)
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
    style.popup_border_size = 1.0


def _colours(style: imgui.Style) -> None:
    col = imgui.Col_
    clear = ImVec4(0, 0, 0, 0)
    accent_soft = ImVec4(ACCENT.x, ACCENT.y, ACCENT.z, 0.35)
    table = {
        col.text: TEXT, col.text_disabled: MUTED, col.window_bg: PANEL, col.child_bg: clear,
        col.popup_bg: ImVec4(0.125, 0.135, 0.155, 0.98), col.border: LINE, col.separator: LINE,
        col.frame_bg: RAISED, col.frame_bg_hovered: HOVER, col.frame_bg_active: HOVER,
        col.button: RAISED, col.button_hovered: HOVER, col.button_active: PRESSED,
        col.header: RAISED, col.header_hovered: HOVER, col.header_active: PRESSED,
        col.slider_grab: accent_soft, col.slider_grab_active: ACCENT, col.check_mark: ACCENT,
        col.plot_histogram: ACCENT, col.text_selected_bg: accent_soft, col.nav_cursor: ACCENT,
        col.scrollbar_bg: clear, col.scrollbar_grab: HOVER, col.scrollbar_grab_hovered: PRESSED,
        col.scrollbar_grab_active: PRESSED, col.modal_window_dim_bg: ImVec4(0, 0, 0, 0.55),
        col.title_bg: PANEL, col.title_bg_active: PANEL, col.input_text_cursor: ACCENT,
    }  # fmt: skip
    for which, colour in table.items():
        style.set_color_(which, colour)
