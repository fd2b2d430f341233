"""Messages over everything, each with a remedy."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from .. import commands as do
from ..kit import theme, widgets
from ..kit.look import Look
from ..state import State, Toast

_FLAGS = widgets.PLAIN | widgets.NO_KEYS | imgui.WindowFlags_.no_focus_on_appearing


def draw(state: State, look: Look, corner: ImVec2) -> list[do.Command]:
    """Messages stacked upwards from `corner`, the lower right of the picture."""
    issued: list[do.Command] = []
    bottom = corner.y - look.px(14)
    for toast in reversed(state.toasts):
        imgui.set_next_window_pos(ImVec2(corner.x - look.px(14), bottom), 0, ImVec2(1, 1))
        imgui.set_next_window_size(ImVec2(look.px(400), 0))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
        imgui.push_style_color(imgui.Col_.window_bg, imgui.get_style().color_(imgui.Col_.popup_bg))
        imgui.begin(f"##toast{toast.key}", None, _FLAGS)
        widgets.to_front()
        issued += _toast(toast, look)
        bottom -= imgui.get_window_height() + look.px(8)
        imgui.end()
        imgui.pop_style_color()
        imgui.pop_style_var()
    return issued


def _toast(toast: Toast, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    error = toast.kind == "error"
    icon = fa.ICON_FA_CIRCLE_EXCLAMATION if error else fa.ICON_FA_CHECK
    imgui.text_colored(theme.BAD if error else theme.GOOD, icon)
    imgui.same_line()
    imgui.push_text_wrap_pos(look.px(400 - 16 - (76 if error else 40)))
    imgui.text_unformatted(widgets.sentence(toast.text) if error else toast.text)
    imgui.pop_text_wrap_pos()
    right, top = look.px(400 - 16 - 30), imgui.get_style().window_padding.y - look.px(6)
    if error:
        imgui.set_cursor_pos(ImVec2(right - look.px(38), top))
        issued += widgets.press(f"{fa.ICON_FA_COPY}##copy", do.CopyText(toast.text), "Copy", quiet=True)
    imgui.set_cursor_pos(ImVec2(right, top))
    return issued + widgets.press(
        f"{fa.ICON_FA_XMARK}##close", do.DismissToast(toast.key), "Close", quiet=True
    )
