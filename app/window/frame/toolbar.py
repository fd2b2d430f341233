"""Above the picture: what it shows, the field of view, home, all of it, export, the menu."""

from imgui_bundle import icons_fontawesome_6 as fa
from imgui_bundle import imgui

from langflash_core.geometry.poses import FOV_RANGE

from .. import commands as do
from ..asking.panels import dictionary
from ..exporting import commands as export
from ..inventory import panel as inventory_panel
from ..kit import widgets
from ..kit.look import Look
from ..scene import camera
from ..scene.panels import modes
from ..state import State
from ..touring import panel as tour_panel
from . import menu

_FOV = 126.0  # design pixels of the slider; left out where the window is too narrow
_LABEL = 40.0  # of its name
_BUTTONS = 7 * 44.0


def draw(state: State, look: Look) -> list[do.Command]:
    """The strip above the picture."""
    issued: list[do.Command] = []
    issued += modes.draw(state, look, imgui.get_window_width() - look.px(_BUTTONS + 40))
    imgui.same_line()
    used = imgui.get_cursor_pos_x()
    width = look.px(_LABEL + _FOV + _BUTTONS)
    roomy = used + width < imgui.get_window_width() - look.px(24)
    width = width if roomy else look.px(_BUTTONS)
    imgui.same_line(imgui.get_window_width() - width - look.px(8))
    issued += _fov(state, look) if roomy else []
    issued += inventory_panel.button(state) + tour_panel.button(state) + dictionary.button(state)
    there = state.scene.info is not None
    for icon, command, tip in (
        (fa.ICON_FA_HOUSE, camera.Home(), "Back to the first photo's view  (H)"),
        (fa.ICON_FA_EXPAND, camera.FrameAll(), "Show all of the scene  (Z)"),
        (fa.ICON_FA_FILE_EXPORT, export.ShowExport(), "Export pictures, masks, videos, splats  (Ctrl+E)"),
    ):
        imgui.same_line()
        issued += widgets.press(icon, command, tip, able=there)
    imgui.same_line()
    return issued + menu.draw(state, look)


def _fov(state: State, look: Look) -> list[do.Command]:
    flat = state.scene.pose.span is not None
    imgui.begin_disabled(state.scene.info is None or flat)
    tip = "Parallel rays have none" if flat else "Field of view over the longer side of the photo"
    degrees = f"{state.scene.pose.fov:.0f}°"
    changed, fov = widgets.slider("FOV##fov", state.scene.pose.fov, FOV_RANGE, degrees, tip, look.px(_FOV))
    imgui.end_disabled()
    imgui.same_line()
    return [camera.SetFov(fov)] if changed else []
