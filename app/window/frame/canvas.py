"""The picture in the middle, and whose hands are on it."""

from imgui_bundle import ImVec2, imgui

from .. import commands as do
from ..asking.panels import parts
from ..asking.parting import TakePartAt
from ..editing.panels import cleaning, gizmo, hands, pointing, ruler
from ..editing.state import Tool
from ..inventory import panel as inventory_panel
from ..kit.look import Look
from ..opening.panels import welcome
from ..scene import camera
from ..scene.panels import floor, in_space, moving
from ..state import State
from ..touring import panel as tour_panel


def draw(state: State, look: Look) -> list[do.Command]:
    """The picture filling the present window, and what the pointer does on it."""
    size = imgui.get_content_region_avail()
    corner = imgui.get_cursor_screen_pos()
    end = ImVec2(corner.x + size.x, corner.y + size.y)
    if look.picture is not None:
        imgui.get_window_draw_list().add_image(imgui.ImTextureRef(look.picture.glo), corner, end)
    else:
        issued = welcome.draw(state, look, corner, size)
        if welcome.working(state):
            welcome.draw_photos(state, look, corner, size)
        return issued
    if welcome.working(state):
        welcome.draw_photos(state, look, corner, size)
        imgui.invisible_button("picture", ImVec2(max(size.x, 1), max(size.y, 1)))
        return []
    floor.draw(state, look, corner, size)
    ruler.draw_line(state, look, corner, size)
    cleaning.draw_box(state, corner, size, look)
    placed, taken = gizmo.draw(state, look, corner, size)
    over = placed if taken else placed + in_space.draw(state, look, corner, size)
    tour_panel.draw_notes(state, look, corner, size)
    inventory_panel.draw_box(state, look, corner, size)
    pointing.draw_marks(state, look, corner, size)
    parts.draw_marks(state, look, corner, size)
    if any(isinstance(command, camera.JumpTo) for command in over):
        return over  # the click was on a camera
    buttons = imgui.ButtonFlags_
    imgui.set_next_item_allow_overlap()
    flags = buttons.mouse_button_left | buttons.mouse_button_right | buttons.mouse_button_middle
    imgui.invisible_button("picture", ImVec2(max(size.x, 1), max(size.y, 1)), flags)
    if state.scene.info is None:
        return over
    if taken:  # the picture is there even so: a press that comes right beside the gizmo finds it hovered
        pose = moving.walked(state, state.scene.pose)
        return over + ([camera.MoveTo(pose)] if pose != state.scene.pose else [])
    issued = over + hands.hover(state, corner)
    if state.editing.draws and not imgui.get_io().key_alt:
        issued += hands.region(state, look, corner)
    elif state.editing.tool is Tool.PLACE:
        issued += hands.pick(state, look, corner)
    elif state.editing.tool in (Tool.POINT, Tool.RULER, Tool.CLONE):
        issued += hands.ask(look, corner)
    elif state.editing.tool is Tool.MOVE and imgui.get_io().key_ctrl:
        issued += [TakePartAt(each.at) for each in hands.ask(look, corner)]
    return issued + moving.draw(state, look, corner, size)
