"""On the picture's left: the tools; beside them what the tool in hand and the selection can do."""

from functools import partial

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.mending.settings import RECIPE_DEFAULTS
from langflash_core.scene.edits import Combine

from ... import commands as do
from ...asking import lifting
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import cleaning as clean
from .. import commands as edit
from .. import mending, placing, things
from .. import pointing as point
from ..state import RADIUS_RANGE, REACH_RANGE, THINGS, Editing, Hiding, Reached, Tool
from . import placing as placing_bar

_TOOLS = (
    (Tool.MOVE, fa.ICON_FA_ARROWS_UP_DOWN_LEFT_RIGHT, "Move around  (V)"),
    (Tool.POINT, fa.ICON_FA_CIRCLE_QUESTION, "What is this? Click on anything  (X)"),
    (Tool.BOX, fa.ICON_FA_VECTOR_SQUARE, "Select with a box  (R)\nShift adds, Ctrl removes, Alt orbits"),
    (Tool.LASSO, fa.ICON_FA_SIGNATURE, "Select with a lasso: draw around it, or click its corners  (L)"),
    (Tool.BRUSH, fa.ICON_FA_PAINTBRUSH, "Select with a brush  (B)\n[ and ] change its size"),
    (Tool.SPHERE, fa.ICON_FA_CIRCLE_DOT, "Select with a ball: drag out from its centre  (O)"),
    (
        Tool.PICK,
        fa.ICON_FA_ARROW_POINTER,
        "Select the thing under a click  (C)\nShift adds, Ctrl removes; [ and ] take less or more",
    ),
    (Tool.PLACE, fa.ICON_FA_CUBE, "Move, turn or scale the selection  (Y, U, I)"),
    (Tool.CLONE, fa.ICON_FA_STAMP, "Clone brush: copy one place over another  (Ctrl+B)"),
    (Tool.RULER, fa.ICON_FA_RULER, "Measure, and set the scale: click both ends  (T)"),
)
_COMBINES: tuple[tuple[Combine, str, str], ...] = (
    ("replace", fa.ICON_FA_SQUARE, "Start a new selection each time"),
    ("add", fa.ICON_FA_PLUS, "Add to the selection  (Shift)"),
    ("remove", fa.ICON_FA_MINUS, "Subtract from the selection  (Ctrl)"),
)
_WAYS = (
    ("blur", "Blur", "Blurred colours, six blocks along its longest side"),
    ("pixels", "Pixels", "Blocks of one colour, six along its longest side"),
    ("remove", "Remove", "Removed; the hole is filled from what is around it"),
)
_BUTTON = 36.0  # design pixels of a tool's side
_SMALLEST = 20.0
_GAP = 2.0
_AROUND = 34.0  # of the strip, beside its tools: its edge and two lines
_VIEWS = 92.0  # that the viewpoints below it take
_MARGIN = 12.0
_TALL = 6.0  # height of what a selection can do in two lines, in lines of text
_REACH = 104.0  # width of the slider of how far a selection grows
_STEPS = "Steps"  # its name
_LEVELS = 130.0  # of that of how much of a thing is selected
_GROWING = _REACH + 130.0  # and of the buttons before it
_MARGIN_SLIDER = 116.0  # of how much around a part is hidden with it
_PADDING = 10.0  # of a bar, left and right


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """Strip and bars over the picture at `place`. Bars go on in a further line where one is too short."""
    corner = ImVec2(place.x + look.px(_MARGIN), place.y + look.px(_MARGIN))
    side = tool_side(size.y / look.scale)
    issued, _ = _panel("##tools", corner, look, lambda: _strip(state, look, side), (6, 6))
    corner = ImVec2(corner.x + look.px(_BUTTON + 22), corner.y)
    end = _beside_dictionary(corner.x, place.x + size.x - look.px(_MARGIN), corner.y)
    right = end - look.px(_PADDING)
    editing, selected = state.editing, state.editing.num_selected > 0
    hidden = editing.marks is not None and bool(editing.marks.hidden)
    bars = (
        (editing.tool.selects, _options),
        (editing.tool is Tool.CLONE, _cloning),
        (editing.tool is Tool.PLACE, placing_bar.draw),
        (selected or editing.waiting, _selection),
        (editing.tint is not None, placing_bar.draw_tint),
        (editing.hiding is not None and selected, _hiding),
        (editing.floaters is not None, _floaters),
        (hidden and not selected, _hidden),
    )
    for number, bar in enumerate(bar for stands, bar in bars if stands):
        wanted, height = _panel(f"##bar{number}", corner, look, partial(bar, state, look, right))
        issued += wanted
        corner = ImVec2(corner.x, corner.y + height + look.px(8))
    return issued


def _beside_dictionary(left: float, right: float, top: float) -> float:
    """Where bars that begin at `left` and `top` end: before the dictionary where that stands beside them."""
    window = imgui.internal.find_window_by_name("Dictionary")
    if window is None or not window.was_active or not left < window.pos.x < right:
        return right
    beside = window.pos.y < top + _TALL * imgui.get_font_size() and window.pos.y + window.size.y > top
    return window.pos.x if beside else right


def tool_side(height: float) -> float:
    """A tool's side, so that the strip ends above the viewpoints; all in design pixels.

    height: of the picture's place.
    """
    room = (height - _MARGIN - _AROUND - _VIEWS) / (len(_TOOLS) + 3) - _GAP
    return min(max(room, _SMALLEST), _BUTTON)


def _panel(
    name: str, corner: ImVec2, look: Look, body, padding: tuple[float, float] = (_PADDING, 7)
) -> tuple[list[do.Command], float]:
    """A rounded window that holds what `body` draws; also its height."""
    imgui.set_next_window_pos(corner)
    with widgets.floating(name, look, padding, imgui.WindowFlags_.always_auto_resize):
        return body(), imgui.get_window_height()


def _strip(state: State, look: Look, wide: float) -> list[do.Command]:
    issued: list[do.Command] = []
    editing = state.editing
    side = look.vec(wide, wide)
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(_GAP, _GAP))
    imgui.push_style_var(imgui.StyleVar_.frame_padding, ImVec2(0, 0))  # small buttons hold their icons, too
    for tool, icon, tip in _TOOLS:
        taken = placing.SetHandle(editing.handle) if tool is Tool.PLACE else point.SetTool(tool)
        issued += widgets.press(icon, taken, tip, side, on=editing.tool is tool)
    imgui.separator()
    tip = "Remove floaters and stray bits, with a preview; within the selection, if there is one"
    shown = editing.floaters is not None
    wanted = edit.EndFloaters() if shown else edit.FindFloaters()
    issued += widgets.press(fa.ICON_FA_WAND_MAGIC_SPARKLES, wanted, tip, side, on=shown)
    imgui.separator()
    history = editing.history
    last = history.done[-1].label if history and history.done else ""
    back: do.Command = edit.Undo()
    if not last and state.scene.unhidden is not None:
        last, back = "what was hidden", mending.BringBack()
    elif not last and state.scene.mute is not None:
        last, back = "answering phrases", lifting.ForgetPhrases()
    following = history.undone[-1].label if history and history.undone else ""
    for icon, verb, label, keys, command in (
        (fa.ICON_FA_ROTATE_LEFT, "Undo", last, "Ctrl+Z", back),
        (fa.ICON_FA_ROTATE_RIGHT, "Redo", following, "Ctrl+Shift+Z", edit.Redo()),
    ):
        tip = f"{verb}: {label}  ({keys})" if label else f"{verb}  ({keys})"
        issued += widgets.press(icon, command, tip, side, able=bool(label))
    imgui.pop_style_var(2)
    return issued


def _button(
    label: str, tip: str, command: do.Command, right: float, gap: float = -1.0, on: bool = False
) -> list[do.Command]:
    """In a bar, beside what is there, or below where that ends at `right`; what it does once pressed."""
    widgets.go_on(widgets.button_width(label), right, gap)
    return widgets.press(label, command, tip, on=on)


def _options(state: State, look: Look, right: float) -> list[do.Command]:
    """How the selecting tool works."""
    issued: list[do.Command] = []
    editing = state.editing
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(4, 4))
    for combine, icon, tip in _COMBINES:
        wanted = point.SetCombine(combine)
        issued += widgets.press(f"{icon}##{combine}", wanted, tip, on=editing.combine == combine)
        imgui.same_line()
    imgui.pop_style_var()
    label, tip = f"{fa.ICON_FA_LAYER_GROUP}  Through", "Also select what is hidden behind other things"
    through = point.SetThrough(not editing.through)
    issued += _button(label, tip, through, right, look.px(14), editing.through)
    return issued + (_radius(state, look, right) if editing.tool is Tool.BRUSH else [])


def _slider(
    label: str,
    value: float,
    limits: tuple[float, float],
    text: str,
    tip: str,
    width: float,
    right: float,
    look: Look,
) -> tuple[bool, float]:
    """As `widgets.slider`, in a bar, or below where that ends at `right`. width: design pixels."""
    widgets.go_on(widgets.named(label, look.px(width)), right, look.px(14))
    return widgets.slider(label, value, limits, text, tip, look.px(width))


def _radius(state: State, look: Look, right: float) -> list[do.Command]:
    """How large the brush is."""
    radius, tip = state.editing.radius, "Radius of the brush, pixels  ([ and ])"
    changed, radius = _slider(
        "Radius##radius", radius, RADIUS_RANGE, f"{radius:.0f} px", tip, 150, right, look
    )
    return [point.SetRadius(radius)] if changed else []


def _cloning(state: State, look: Look, right: float) -> list[do.Command]:
    """What the clone brush waits for, and how it works."""
    editing = state.editing
    imgui.align_text_to_frame_padding()
    if editing.source is None:
        imgui.text("Click what to copy")
        return []
    imgui.text("Paint where to put it")
    tip = "Copy from another place  (Alt+click; Alt+drag orbits)"
    issued = _button(fa.ICON_FA_EYE_DROPPER, tip, mending.ForgetSource(), right, look.px(14))
    label = f"{fa.ICON_FA_UP_RIGHT_AND_DOWN_LEFT_FROM_CENTER}  Fit"
    tip = "Scale copies to match the detail there; otherwise they keep their size"
    issued += _button(label, tip, mending.SetFit(not editing.fit), right, on=editing.fit)
    return issued + _radius(state, look, right)


def _selection(state: State, look: Look, right: float) -> list[do.Command]:
    """How much is selected, and what can be done with it."""
    issued: list[do.Command] = []
    editing = state.editing
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.SELECTED, fa.ICON_FA_DRAW_POLYGON)
    imgui.same_line()
    begin = imgui.get_cursor_pos_x()
    imgui.text(waits(editing) or f"{editing.num_selected:,} selected")
    if not editing.num_selected:
        return issued
    count = 0 if state.scene.info is None else state.scene.info.num_gaussians
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(4, 4))
    imgui.same_line(begin + imgui.calc_text_size(f"{count:,} selected").x + look.px(14))
    issued += _actions(right)
    widgets.go_on(widgets.named(_STEPS, look.px(_GROWING)), right, look.px(14))  # all of it
    issued += _growing(state, look)
    if editing.reached is not None:
        issued += _levels(editing.reached, look, right)
    imgui.pop_style_var()
    return issued


def waits(editing: Editing) -> str:
    """What is being looked for and, where that takes long, how far it is."""
    if editing.waiting == THINGS and editing.searched < 1:
        return f"{THINGS}, once per scene: {editing.searched:.0%}"
    return f"{editing.waiting} ..." if editing.waiting else ""


def _levels(reached: Reached, look: Look, right: float) -> list[do.Command]:
    """Less and more of the thing that was clicked."""
    last, tip = len(reached.levels) - 1, "Less or more: part, thing, group  ([ and ], or Ctrl+wheel)"
    if not last:
        return []
    text, limits = f"{reached.level + 1}/{last + 1}", (0.0, float(last))
    changed, level = _slider("Size##level", reached.level, limits, text, tip, _LEVELS, right, look)
    return [things.SetLevel(round(level))] if changed else []


def _actions(right: float) -> list[do.Command]:
    """What is done with a selection, a button each."""
    issued: list[do.Command] = []
    actions: list[tuple[str, str, do.Command]] = [
        (fa.ICON_FA_CIRCLE_HALF_STROKE, "Select the rest instead  (Ctrl+I)", edit.Invert()),
        (fa.ICON_FA_EYE_SLASH, "Hide", edit.Hide()),
        (fa.ICON_FA_CROP_SIMPLE, "Show this alone", edit.Isolate()),
        (fa.ICON_FA_EXPAND, "Fly to it  (F)", point.FrameSelection()),
        (fa.ICON_FA_PALETTE, "Recolour  (Ctrl+T)", placing.BeginTint()),
        (fa.ICON_FA_TRASH, "Delete  (Del)", edit.Delete()),
        (fa.ICON_FA_CLONE, "Copy it, to place elsewhere  (Ctrl+J)", mending.CopySelection()),
        (fa.ICON_FA_FILL_DRIP, "Delete, and fill the hole from what is around it", mending.FillSelection()),
        (fa.ICON_FA_USER_SECRET, "Hide for good: blur, pixelate or remove", mending.AskToHide()),
        (fa.ICON_FA_XMARK, "Select nothing  (Ctrl+D)", edit.Deselect()),
    ]
    for place, (icon, tip, command) in enumerate(actions):
        if place:
            widgets.go_on(widgets.button_width(icon), right)
        issued += widgets.press(icon, command, tip)
    return issued


def _growing(state: State, look: Look) -> list[do.Command]:
    """Grow the selection, over anything or over what the active phrase means, and how far."""
    issued: list[do.Command] = []
    editing = state.editing
    if imgui.button(f"{fa.ICON_FA_MAXIMIZE}  Grow"):
        issued.append(edit.Grow())
    widgets.tooltip(f"Grow by {editing.reach:.0f} step{'s' * (round(editing.reach) != 1)}  (G)")
    active = state.asking.active_prompt
    if active is not None:
        imgui.same_line()
        if imgui.button(fa.ICON_FA_MAGNIFYING_GLASS_PLUS):
            issued.append(edit.Grow(phrase=True))
        widgets.tooltip(f"Grow, but only over '{active.text.strip()}'")
    imgui.same_line()
    tip, width = "How far to grow, in steps (a step is the distance between neighbours)", look.px(_REACH)
    text = f"{editing.reach:.0f}"
    changed, reach = widgets.slider(f"{_STEPS}##reach", editing.reach, REACH_RANGE, text, tip, width)
    if changed:
        issued.append(point.SetReach(round(reach)))
    return issued


def _floaters(state: State, look: Look, right: float) -> list[do.Command]:
    """The preview of floaters, in red in the picture."""
    issued: list[do.Command] = []
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.BAD, fa.ICON_FA_WAND_MAGIC_SPARKLES)
    imgui.same_line()
    found, marks = state.editing.floaters, state.editing.marks
    if found is None or not found.least or marks is None:
        imgui.text("Looking for floaters ...")
        return issued
    count, strength = len(found.mask(marks.visible)), found.strength
    imgui.text(f"{count:,} to remove" + (" in the selection" if found.within is not None else ""))
    label, text, tip = "Strength##strength", f"{100 * strength:.0f} %", "How much is removed"
    changed, strength = _slider(label, strength, (0.0, 1.0), text, tip, 170, right, look)
    if changed:
        issued.append(edit.SetStrength(strength))
    return issued + _end_floaters(count, found.open, look, right)


def _hiding(state: State, look: Look, right: float) -> list[do.Command]:
    """The ways to hide the selection for good, and how much around it; in red in the picture."""
    asked, issued = state.editing.hiding, list[do.Command]()
    assert asked is not None
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.SELECTED, fa.ICON_FA_USER_SECRET)
    imgui.same_line()
    imgui.text("Hide for good, in photos too:")
    for place, (how, name, tip) in enumerate(_WAYS):
        gap = look.px(14 if place == 0 else 4)
        issued += _button(f"{name}##{how}", tip, mending.AskToHide(how), right, gap, how == asked.how)
    issued += _margin(state, asked, look, right)
    tip = "You can undo this until the scene is saved; the saved file no longer holds it"
    hide = mending.HideForGood(asked.how, asked.margin)
    issued += _button("Hide it##for good", tip, hide, right, look.px(14), True)
    return issued + _button("Cancel##hiding", "Cancel  (Esc)", mending.AskToHide(""), right)


def _margin(state: State, asked: Hiding, look: Look, right: float) -> list[do.Command]:
    """How much around the selection is hidden with it, and how many Gaussians that are."""
    tip = "How much around it is hidden too, as a share of a photo's longer side"
    label, text = "Margin##margin", f"{100 * asked.margin:.1f} %"
    limits = (0.0, RECIPE_DEFAULTS.most_margin)
    changed, margin = _slider(label, asked.margin, limits, text, tip, _MARGIN_SLIDER, right, look)
    found = None if state.editing.marks is None else asked.mask(state.editing.marks)
    words = "looking ..." if found is None else f"{len(found):,} in all"
    count = 0 if state.scene.info is None else state.scene.info.num_gaussians
    widest = max(imgui.calc_text_size(text).x for text in (words, f"{count:,} in all"))
    widgets.go_on(widest, right)  # so it stays in its line
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED if found is None else theme.BAD, words)
    return [mending.SetMargin(margin)] if changed else []


def _end_floaters(count: int, opened: bool, look: Look, right: float) -> list[do.Command]:
    """Its rules, and the ways out of the preview of so many."""
    label, rules = f"{fa.ICON_FA_SLIDERS}  Rules", clean.ShowRules(not opened)
    tip = "By certainty, size, opacity, colour, distance or photos; by a box; by recipes"
    issued = _button(label, tip, rules, right, look.px(14), opened)
    imgui.begin_disabled(count == 0)
    issued += _button("Delete##floaters", "", edit.EndFloaters("delete"), right, look.px(14), True)
    issued += _button("Select##floaters", "", edit.EndFloaters("select"), right)
    imgui.end_disabled()
    return issued + _button("Cancel##floaters", "Cancel  (Esc)", edit.EndFloaters(), right)


def _hidden(state: State, look: Look, right: float) -> list[do.Command]:
    """That something is hidden, and the way back."""
    assert state.editing.marks is not None
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, f"{fa.ICON_FA_EYE_SLASH}  {len(state.editing.marks.hidden):,} hidden")
    imgui.same_line()
    return [edit.ShowAll()] if imgui.button("Show all") else []
