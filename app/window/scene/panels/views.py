"""The scene's own photos as buttons in the picture's corner."""

from dataclasses import replace

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...filming import commands as film
from ...kit import theme, widgets
from ...kit.look import Look
from ...recovery import commands as keep
from ...state import State
from .. import camera
from . import in_space, places

_VIEW = 54.0  # of a photo to jump to
_MARK = 7.5  # the radius of what marks a photo
_BESIDE, _HIGHEST = 154.0, 62.0  # the switches' room at their right, and their height


def draw(state: State, look: Look) -> list[do.Command]:
    """Buttons with the scene's own photos, to jump to their views."""
    issued: list[do.Command] = []
    if state.scene.info is None:
        return issued
    height = look.px(_VIEW)
    flags = imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_scroll_with_mouse
    room = imgui.get_main_viewport().size.x - imgui.get_window_pos().x - look.px(_BESIDE)
    scrolls = _wide(len(state.scene.info.views), look) > room
    if scrolls:  # the switches stay in sight; the photos go by below the wheel
        shape = imgui.ChildFlags_.nav_flattened | imgui.ChildFlags_.always_auto_resize
        shape |= imgui.ChildFlags_.auto_resize_x | imgui.ChildFlags_.auto_resize_y
        imgui.set_next_window_size_constraints(ImVec2(0, 0), ImVec2(max(room, height), look.px(_HIGHEST)))
        imgui.begin_child("##all", ImVec2(0, 0), shape, flags)
        _roll()
    for view in range(len(state.scene.info.views)):
        if view:
            imgui.same_line()
        doubt = state.scene.info.doubts.get(view, "")
        ring = theme.ACCENT if state.scene.view == view else theme.RAISED
        picture = look.thumbnails.get(f"view {view}")
        imgui.push_id(view)
        with widgets.colours(button=ring, button_hovered=theme.ACCENT, button_active=theme.ACCENT):
            if picture is None:
                pressed = imgui.button(str(view + 1), ImVec2(height, height))
            else:
                imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(3, 3))
                pressed = imgui.image_button("view", picture[0], ImVec2(round(height * picture[1]), height))
                imgui.pop_style_var()
        if doubt:
            _mark(look)
        where = f"Go to where photo {view + 1} was taken" + ("; scroll for more" if scrolls else "")
        widgets.tooltip(f"{where}\n{doubt}" if doubt else where)
        if pressed:
            issued.append(camera.JumpTo(view))
        imgui.pop_id()
    if scrolls:
        imgui.end_child()
    imgui.same_line(0, look.px(12))
    issued += _in_space(state, look)
    imgui.same_line(0, look.px(4))
    size = look.vec(34, _VIEW + 6)
    issued += widgets.press(fa.ICON_FA_VIDEO, film.AddKey(), "Add this view as a key frame  (M)", size)
    if places.offered(state.scene.info):
        imgui.same_line(0, look.px(4))
        issued += places.draw(state, look, size)
    return issued


def _wide(count: int, look: Look) -> float:
    """Pixels of all photos side by side."""
    pictures = (look.thumbnails.get(f"view {view}") for view in range(count))
    wide = [round(look.px(_VIEW) * p[1]) + 2 * look.px(3) if p else look.px(_VIEW) for p in pictures]
    return sum(wide) + (count - 1) * imgui.get_style().item_spacing.x


def _mark(look: Look) -> None:
    """In the upper right corner of the photo just drawn: something about it does not look right."""
    corner, reach = imgui.get_item_rect_max(), look.px(_MARK)
    middle = ImVec2(corner.x - 1.3 * reach, imgui.get_item_rect_min().y + 1.3 * reach)
    imgui.get_window_draw_list().add_circle_filled(middle, reach, widgets.u32(theme.BAD))
    widgets.centred("!", middle, theme.ON_ACCENT)


def _roll() -> None:
    """The wheel moves the photos sideways."""
    wheel = imgui.get_io().mouse_wheel
    if wheel and imgui.is_window_hovered():
        imgui.set_scroll_x(imgui.get_scroll_x() - 2 * wheel * imgui.get_text_line_height())


def _in_space(state: State, look: Look) -> list[do.Command]:
    """Two switches beside the photos: compare with the photo, and the cameras in the scene."""
    issued: list[do.Command] = []
    size, wanted = look.vec(34, (_VIEW + 6 - 4) / 2), state.preferences  # together as high as a photo
    imgui.begin_group()
    imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(4, 4))
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(4, 4))
    on, able = in_space.comparing(state), state.scene.view is not None
    compare, tip = camera.Compare(None if on else 0.5), "Compare with the photo, when standing at one  (P)"
    issued += widgets.press(fa.ICON_FA_LEFT_RIGHT, compare, tip, size, able, on)
    on, tip = wanted.photos_in_space, "Show the photos' cameras in the scene  (K)"
    if widgets.press(fa.ICON_FA_CAMERA, None, tip, size, on=on):
        issued.append(keep.Prefer(replace(wanted, photos_in_space=not on)))
    imgui.pop_style_var(2)
    imgui.end_group()
    return issued
