"""Above the picture: what it shows, the field of view, home, all of it, export, the menu."""

from dataclasses import replace

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from app.window import commands as do
from app.window import desk_commands as desk
from app.window import theme
from app.window.panels import dictionary, in_space, menu, modes, widgets
from app.window.panels.look import Look
from app.window.poses import FOV_RANGE
from app.window.state import State

_FOV = 150.0  # design pixels of the slider; left out where the window is too narrow
_LABEL = 40.0  # of its name
_BUTTONS = 5 * 44.0
_VIEW = 54.0  # of a photo to jump to


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
    return issued + dictionary.button(state) + _home(state) + _files(state, look)


def _fov(state: State, look: Look) -> list[do.Command]:
    imgui.begin_disabled(state.info is None)
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, "FOV")
    imgui.same_line()
    tip = "Field of view over the longer side of the photo"
    degrees = f"{state.pose.fov:.0f}°"
    changed, fov = widgets.slider("##fov", state.pose.fov, FOV_RANGE, degrees, tip, look.px(_FOV))
    imgui.end_disabled()
    imgui.same_line()
    return [do.SetFov(fov)] if changed else []


def _home(state: State) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.same_line()
    imgui.begin_disabled(state.info is None)
    if imgui.button(fa.ICON_FA_HOUSE):
        issued.append(do.Home())
    widgets.tooltip("Back to the first photo's view  (H)")
    imgui.end_disabled()
    return issued


def _files(state: State, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.same_line()
    imgui.begin_disabled(state.info is None)
    if imgui.button(fa.ICON_FA_EXPAND):
        issued.append(desk.FrameAll())
    widgets.tooltip("Show all of the scene  (Z)")
    imgui.same_line()
    if imgui.button(fa.ICON_FA_FILE_EXPORT):
        issued.append(desk.ShowExport())
    widgets.tooltip("Export pictures, masks, videos, splats  (Ctrl+E)")
    imgui.end_disabled()
    imgui.same_line()
    return issued + menu.draw(state, look)


def draw_views(state: State, look: Look) -> list[do.Command]:
    """Buttons with the scene's own photos, to jump to their views."""
    issued: list[do.Command] = []
    if state.info is None:
        return issued
    height = look.px(_VIEW)
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
                pressed = imgui.image_button("view", picture[0], ImVec2(round(height * picture[1]), height))
                imgui.pop_style_var()
        widgets.tooltip(f"Stand where photo {view} was taken")
        if pressed:
            issued.append(do.JumpTo(view))
        imgui.pop_id()
    imgui.same_line(0, look.px(12))
    return issued + _in_space(state, look)


def _in_space(state: State, look: Look) -> list[do.Command]:
    """Two switches beside the photos: compare with the photo, and the cameras in the scene."""
    issued: list[do.Command] = []
    size, wanted = look.vec(34, (_VIEW + 6 - 4) / 2), state.desk.preferences  # together as high as a photo
    imgui.begin_group()
    imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(4, 4))
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(4, 4))
    imgui.begin_disabled(state.view is None)
    if _switch(fa.ICON_FA_LEFT_RIGHT, in_space.comparing(state), size):
        issued.append(desk.Compare(None if in_space.comparing(state) else 0.5))
    imgui.end_disabled()
    widgets.tooltip("Compare with the photo, at a photo's own view  (P)")
    if _switch(fa.ICON_FA_CAMERA, wanted.photos_in_space, size):
        issued.append(desk.Prefer(replace(wanted, photos_in_space=not wanted.photos_in_space)))
    widgets.tooltip("Show the photos' cameras in the scene  (K)")
    imgui.pop_style_var(2)
    imgui.end_group()
    return issued


def _switch(icon: str, on: bool, size: ImVec2) -> bool:
    return widgets.primary_button(icon, size) if on else imgui.button(icon, size)
