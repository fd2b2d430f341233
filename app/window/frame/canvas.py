"""The picture in the middle, and whose hands are on it."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from .. import commands as do
from ..editing.panels import hands
from ..editing.state import Tool
from ..kit import theme, widgets
from ..kit.look import Look
from ..scene import camera
from ..scene.panels import in_space, moving
from ..state import State


def draw(state: State, look: Look) -> list[do.Command]:
    """The picture filling the present window, and what the pointer does on it."""
    size = imgui.get_content_region_avail()
    corner = imgui.get_cursor_screen_pos()
    end = ImVec2(corner.x + size.x, corner.y + size.y)
    if look.picture is not None:
        imgui.get_window_draw_list().add_image(imgui.ImTextureRef(look.picture.glo), corner, end)
    else:
        _welcome(state, corner, size)
    over = in_space.draw(state, look, corner, size)
    if any(isinstance(command, camera.JumpTo) for command in over):
        return over  # the click was on a camera
    buttons = imgui.ButtonFlags_
    imgui.set_next_item_allow_overlap()
    flags = buttons.mouse_button_left | buttons.mouse_button_right | buttons.mouse_button_middle
    imgui.invisible_button("picture", ImVec2(max(size.x, 1), max(size.y, 1)), flags)
    if state.info is None:
        return []
    issued = over + hands.hover(state, corner)
    if state.editing.tool.selects and not imgui.get_io().key_alt:
        issued += hands.region(state, look, corner)
    elif state.editing.tool is Tool.POINT:
        issued += hands.ask(look, corner)
    pose = moving.pointed(state, look, size)
    pose = moving.flown(pose, state.preferences.speed)
    return issued + ([camera.MoveTo(pose)] if pose != state.pose else [])


def _welcome(state: State, corner: ImVec2, size: ImVec2) -> None:
    """What to do first, in the middle of the empty canvas."""
    text = f"{state.job.title}: {state.job.stage}" if state.job else "Drop photos of a room here"
    lines = ((fa.ICON_FA_CUBES, theme.LINE, 3.0), (text, theme.MUTED, 1.25))
    top = corner.y + size.y / 2
    canvas = imgui.get_window_draw_list()
    for line, colour, factor in lines:
        imgui.push_font(None, theme.FONT_SIZE * factor)
        extent = imgui.calc_text_size(line)
        canvas.add_text(ImVec2(corner.x + (size.x - extent.x) / 2, top - extent.y), widgets.u32(colour), line)
        top += extent.y * 1.4
        imgui.pop_font()
