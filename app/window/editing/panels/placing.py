"""Bars over the picture: the numbers of the gizmo, and the colour of a tint."""

from imgui_bundle import icons_fontawesome_6 as fa
from imgui_bundle import imgui

from langflash_core.scene.changes import Moved
from langflash_core.scene.settings import CHANGES

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import placing
from ..state import Handle, Tint

_HANDLES = (
    (Handle.MOVE, fa.ICON_FA_ARROWS_UP_DOWN_LEFT_RIGHT, "Move  (Y)"),
    (Handle.TURN, fa.ICON_FA_ROTATE, "Turn  (U)"),
    (Handle.SCALE, fa.ICON_FA_UP_RIGHT_AND_DOWN_LEFT_FROM_CENTER, "Scale  (I)"),
)
_FIELD = 84.0  # design pixels
_DIGITS = {Handle.MOVE: "%.3f", Handle.TURN: "%.1f\u00b0", Handle.SCALE: "%.3f \u00d7"}
_SPEEDS = {Handle.MOVE: 0.002, Handle.TURN: 0.5, Handle.SCALE: 0.005}  # per pixel of a drag


def draw(state: State, look: Look, right: float) -> list[do.Command]:
    """What the gizmo does, and by how much: drag a number, or double-click and type it. right: where a line
    ends."""
    issued: list[do.Command] = []
    editing, info = state.editing, state.scene.info
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(4, 4))
    for handle, icon, tip in _HANDLES:
        tip = f"{tip}\nCtrl snaps, Ctrl+arrows move in steps"
        taken = placing.SetHandle(handle)
        issued += widgets.press(f"{icon}##{handle.name}", taken, tip, on=editing.handle is handle)
        imgui.same_line()
    imgui.pop_style_var()
    if editing.marks is None or info is None or not editing.marks.selected:
        said = "Click a thing to select it"
        widgets.go_on(imgui.calc_text_size(said).x, right)
        imgui.align_text_to_frame_padding()
        imgui.text_colored(theme.MUTED, said)
        return issued
    pivot = placing.pivot_of(info, editing.marks)
    return issued if pivot is None else issued + _fields(state, pivot, look, right)


def _fields(state: State, pivot: placing.Spot, look: Look, right: float) -> list[do.Command]:
    editing = state.editing
    assert editing.marks is not None
    unit = 100 * state.metric if state.metric and editing.handle is Handle.MOVE else 1.0
    digits = "%.1f cm" if unit != 1.0 else _DIGITS[editing.handle]
    numbers = [unit * each for each in placing.numbers_of(editing.gesture, pivot, editing.handle)]
    changed = False
    for place, number in enumerate(numbers):
        named = len(numbers) > 1
        widgets.go_on(look.px(_FIELD + 15 * named), right, look.px(10))
        if named:
            imgui.align_text_to_frame_padding()
            imgui.text_colored(theme.AXES[place], "xyz"[place])
            imgui.same_line(0, look.px(5))
        imgui.set_next_item_width(look.px(_FIELD))
        speed = unit * _SPEEDS[editing.handle]
        low, high = CHANGES.scales if editing.handle is Handle.SCALE else (0.0, 0.0)
        edited, value = imgui.drag_float(f"##{'xyz'[place]}", number, speed, low, high, digits)
        widgets.tooltip("Drag, or double-click and type; relative to where the selection is now")
        if edited:
            numbers[place], changed = value, True
    if not changed:
        return []
    wanted = placing.of_numbers(tuple(each / unit for each in numbers), editing.marks, pivot, editing.handle)
    return [placing.Adjust(wanted)] if isinstance(wanted, Moved) else []


def draw_tint(state: State, look: Look, right: float) -> list[do.Command]:
    """Colour and strength, as the picture shows them; made or taken away. right: where a line ends."""
    editing, info, tint = state.editing, state.scene.info, state.editing.tint
    if editing.marks is None or info is None or tint is None:
        return []
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, fa.ICON_FA_PALETTE)
    imgui.same_line()
    imgui.set_next_item_width(look.px(190))
    flags = imgui.ColorEditFlags_.no_inputs | imgui.ColorEditFlags_.no_label
    repainted, colour = imgui.color_edit3("##tint", list(tint.colour), flags)
    widgets.tooltip("The new colour; light and shade are kept")
    label, text, tip = "Strength##strength", f"{100 * tint.strength:.0f} %", "Strength of the colour"
    width = look.px(150)
    widgets.go_on(widgets.named(label, width), right)
    moved, strength = widgets.slider(label, tint.strength, (0.0, 1.0), text, tip, width)
    widgets.go_on(widgets.button_width("Recolour"), right, look.px(14))
    issued: list[do.Command] = []
    if repainted or moved:
        red, green, blue = (min(max(float(each), 0.0), 1.0) for each in colour)
        wanted = Tint((red, green, blue), strength)
        issued.append(placing.ShowTint(wanted, placing.luma_of(info, editing.marks)))
    if widgets.primary_button("Recolour"):
        issued.append(placing.EndGesture())
    widgets.tooltip("Apply  (Ctrl+T)")
    widgets.go_on(widgets.button_width("Cancel"), right)
    if imgui.button("Cancel##tint"):
        issued.append(placing.EndGesture(keep=False))
    widgets.tooltip("Cancel  (Esc)")
    return issued
