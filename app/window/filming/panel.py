"""Over the picture's upper right: the key frames that there are; in the picture their places and the way."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from .. import commands as do
from ..kit import boxes, theme, widgets
from ..kit.look import Look
from ..scene import camera
from ..state import State
from . import commands as film

_MARGIN = 12.0  # design pixels
_MOST_SHOWN = 8


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """A small bar; nothing without key frames."""
    if not state.keys:
        return []
    issued: list[do.Command] = []
    corner = ImVec2(place.x + size.x - look.px(_MARGIN), place.y + look.px(_MARGIN))
    imgui.set_next_window_pos(ImVec2(corner.x, _top(corner, look)), 0, ImVec2(1, 0))
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    imgui.push_style_var(imgui.StyleVar_.window_padding, look.vec(8, 6))
    flags = widgets.PLAIN | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_focus_on_appearing
    with widgets.colours(window_bg=imgui.get_style().color_(imgui.Col_.popup_bg)):
        imgui.begin("##keys", None, flags)
        issued += _bar(state, look)
        imgui.end()
    imgui.pop_style_var(2)
    return issued


def _top(corner: ImVec2, look: Look) -> float:
    """Where the bar begins whose upper right corner is to be there: below axes and bars in its way."""
    own = imgui.internal.find_window_by_name("##keys")
    size = ImVec2(0, 0) if own is None else own.size
    box, axes = (corner.x - size.x, corner.y, corner.x, corner.y + size.y), boxes.window_box("##axes")
    return boxes.lowered(box, [*boxes.bars(), *([] if axes is None else [axes])], look.px(8))


def _bar(state: State, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(4, 4))
    keys, playing = state.keys, state.filming.tour is not None
    count = len(keys)
    icon, command = (fa.ICON_FA_STOP, film.StopTour()) if playing else (fa.ICON_FA_PLAY, film.Preview())
    tip = "Fly along the key frames  (J)"
    issued += widgets.press(f"{icon}##tour", command, tip, able=playing or count > 1)
    for place in range(min(count, _MOST_SHOWN)):
        imgui.same_line()
        there, tip = camera.FlyTo(keys[place]), "Fly there; right-click removes it"
        issued += widgets.press(f"{place + 1}##key", there, tip)
        if imgui.is_item_clicked(imgui.MouseButton_.right):
            issued.append(film.RemoveKey(place))
    if count > _MOST_SHOWN:
        imgui.same_line()
        imgui.text_colored(theme.MUTED, f"+{count - _MOST_SHOWN}")
    imgui.same_line()
    issued += widgets.press(f"{fa.ICON_FA_PLUS}##key", film.AddKey(), "Add this view as a key frame  (M)")
    imgui.same_line()
    tip = "Remove all key frames"
    issued += widgets.press(f"{fa.ICON_FA_TRASH}##keys", film.ClearKeys(), tip, quiet=True)
    imgui.pop_style_var()
    return issued
