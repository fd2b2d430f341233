"""Above the picture: what it shows, the field of view, home, open and save."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from app.window import commands as do
from app.window import theme
from app.window.panels import modes, widgets
from app.window.panels.look import Look
from app.window.poses import FOV_RANGE
from app.window.state import State

_FOV = 150.0  # design pixels of the slider; left out where the window is too narrow
_BUTTONS = 4 * 44.0


def draw(state: State, look: Look) -> list[do.Command]:
    """The strip above the picture."""
    issued: list[do.Command] = []
    issued += modes.draw(state, look, imgui.get_window_width() - look.px(_BUTTONS + 40))
    imgui.same_line()
    used = imgui.get_cursor_pos_x()
    width = look.px(_FOV + _BUTTONS)
    roomy = used + width < imgui.get_window_width() - look.px(24)
    width = width if roomy else look.px(_BUTTONS)
    imgui.same_line(imgui.get_window_width() - width - look.px(8))
    return issued + (_fov(state, look) if roomy else []) + _home(state) + _files(state)


def _fov(state: State, look: Look) -> list[do.Command]:
    imgui.begin_disabled(state.info is None)
    tip = "Field of view over the longer side of the photo"
    degrees = f"{state.pose.fov:.0f}°"
    changed, fov = widgets.slider("##fov", state.pose.fov, FOV_RANGE, degrees, tip, look.px(_FOV))
    imgui.end_disabled()
    imgui.same_line()
    return [do.SetFov(fov)] if changed else []


def _home(state: State) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.begin_disabled(state.info is None)
    if imgui.button(fa.ICON_FA_HOUSE):
        issued.append(do.Home())
    widgets.tooltip("Back to the first photo's view  (H)")
    imgui.end_disabled()
    return issued


def _files(state: State) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.same_line()
    if imgui.button(fa.ICON_FA_FOLDER_OPEN):
        issued.append(do.ShowDialog("open"))
    widgets.tooltip("Open photos or a scene  (Ctrl+O)")
    imgui.same_line()
    imgui.begin_disabled(state.info is None)
    if imgui.button(fa.ICON_FA_FLOPPY_DISK):
        issued.append(do.ShowDialog("save"))
    widgets.tooltip("Save the scene  (Ctrl+S)")
    imgui.end_disabled()
    imgui.same_line()
    if imgui.button(fa.ICON_FA_QUESTION):
        issued.append(do.ShowDialog("help"))
    widgets.tooltip("Mouse and keys  (F1)")
    return issued


def draw_views(state: State, look: Look) -> list[do.Command]:
    """Buttons with the scene's own photos, to jump to their views."""
    issued: list[do.Command] = []
    if state.info is None:
        return issued
    height = look.px(54)
    for view in range(len(state.info.views)):
        if view:
            imgui.same_line()
        chosen = state.view == view
        ring = theme.ACCENT if chosen else theme.RAISED
        picture = look.thumbnails.get(f"view {view}")
        imgui.push_id(view)
        with widgets.colours(button=ring, button_hovered=theme.ACCENT, button_active=theme.ACCENT):
            if picture is None:
                pressed = imgui.button(str(view), ImVec2(height, height))
            else:
                imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(3, 3))
                pressed = imgui.image_button("view", picture[0], ImVec2(height * picture[1], height))
                imgui.pop_style_var()
        widgets.tooltip(f"Stand where photo {view} was taken")
        if pressed:
            issued.append(do.JumpTo(view))
        imgui.pop_id()
    return issued
