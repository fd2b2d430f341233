"""Over the picture: the rules of a clean-up, line by line, and its box drawn in the picture."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.geometry import poses
from langflash_core.mending.recipes import COLOUR, KINDS, PRESETS, Box, Rule

from ... import commands as do
from ...dialogs import Dialog
from ...kit import boxes, theme, widgets
from ...kit.look import Look
from ...state import State
from .. import cleaning as clean
from ..cleaning import ABOVE, BELOW, Condition
from ..state import Floaters

_WIDE, _TOP = 360.0, 150.0  # design pixels; _TOP: below the axes
_HIGH, _LOW = 530.0, 160.0  # at the most, of what a box needs; at the least
_NAME, _SIDE, _VALUE = 106.0, 76.0, 80.0
_NAMES = {
    "confidence": "Sureness", "size": "Size", "opacity": "Opacity", "depth": "Distance",
    "photos": "Photos", COLOUR: "Colour",
}  # fmt: skip
_TIPS = {
    "confidence": "Certainty of its depth, 0 to 1",
    "size": "Its radius, scene units",
    "opacity": "0 (clear) to 1",
    "depth": "How far from the nearest photo's place, scene units",
    "photos": "How many photos see it",
}
_RANGES = {"confidence": (0.0, 1.0), "opacity": (0.0, 1.0)}  # others from 0 on
_FORMATS = {"photos": "%.0f"}
_NEAREST = 1e-3  # of a box's corners on one axis
_EDGES = [(a, a | 1 << k) for a in range(8) for k in range(3) if not a >> k & 1]


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """The window over the picture's right side, or over the panel where that is narrow, while a clean-up is
    previewed and its rules are asked for."""
    preview = state.editing.floaters
    if preview is None or not preview.open:
        return []
    corner, extent = boxes.opens_at(place, size, size.y, look, _TOP, (_WIDE, _HIGH), _LOW)
    imgui.set_next_window_pos(corner, imgui.Cond_.appearing)
    imgui.set_next_window_size(extent, imgui.Cond_.appearing)
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    flags = imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings
    issued: list[do.Command] = []
    shown, kept = imgui.begin("Rules", True, flags)
    if shown:
        for part in (_kinds, _rules, _limits, partial(_crop, around=_around(state)), _files):
            issued += part(preview, look)
    imgui.end()
    imgui.pop_style_var()
    return issued if kept else [*issued, clean.ShowRules(False)]


def _kinds(preview: Floaters, look: Look) -> list[do.Command]:
    """What the strength looks for."""
    issued: list[do.Command] = []
    widgets.muted("By strength:")
    for place, kind in enumerate(KINDS):
        if place % 2:
            imgui.same_line(look.px(_WIDE / 2))
        changed, on = widgets.checkbox(f"{kind.capitalize()}##kind", kind in preview.recipe.kinds)
        if changed:
            wanted = {*preview.recipe.kinds, kind} if on else {*preview.recipe.kinds} - {kind}
            issued.append(clean.ChangeRecipe({"kinds": tuple(k for k in KINDS if k in wanted)}))
    return issued


def _rules(preview: Floaters, look: Look) -> list[do.Command]:
    """Every rule, its conditions below each other; one more."""
    rules, issued = preview.recipe.rules, []
    imgui.separator_text("And by rules")
    for number, rule in enumerate(rules):
        if number:
            widgets.muted("or")
        imgui.push_id(number)
        after = _rule(rule, look)
        imgui.pop_id()
        if after is not None:
            changed = (*rules[:number], *([after] if after else []), *rules[number + 1 :])
            issued.append(clean.ChangeRecipe({"rules": changed}))
    name = _choose(f"{fa.ICON_FA_PLUS}  {'Another rule' if rules else 'A rule'}", tuple(_NAMES))
    if name:
        more = clean.rule_of([clean.first_of(name)])
        issued.append(clean.ChangeRecipe({"rules": (*rules, more)}))
    return issued


def _rule(rule: Rule, look: Look) -> Rule | None:
    """The conditions of one rule; another rule where hands changed it, an empty one without any."""
    lines, after = clean.conditions(rule), None
    for number, line in enumerate(lines):
        imgui.push_id(number)
        changed = _line(line, rule, look)
        imgui.same_line(0, look.px(4))
        gone = widgets.quiet_button(fa.ICON_FA_XMARK, "Remove this condition")
        imgui.pop_id()
        if gone or changed is not None:
            kept = [] if gone or changed is None else [changed]
            after = clean.rule_of([*lines[:number], *kept, *lines[number + 1 :]])
    free = clean.free_names(rule)
    name = _choose(f"{fa.ICON_FA_PLUS}  and", free) if free else None
    return clean.rule_of([*lines, clean.first_of(name)]) if name else after


def _choose(label: str, names: Sequence[str]) -> str | None:
    """A button that asks for the name of a measure."""
    if imgui.button(label):
        imgui.open_popup("measures")
    chosen = None
    if imgui.begin_popup("measures"):
        for name in names:
            if imgui.selectable(_NAMES[name], False)[0]:
                chosen = name
            widgets.tooltip(_TIPS.get(name, ""))
        imgui.end_popup()
    return chosen


def _line(line: Condition, rule: Rule, look: Look) -> Condition | None:
    """One condition; another where hands changed it."""
    imgui.align_text_to_frame_padding()
    imgui.text(_NAMES[line.name])
    widgets.tooltip(_TIPS.get(line.name, ""))
    imgui.same_line(look.px(_NAME))
    if line.name == COLOUR:
        return _shade(line, look)
    both = all(limit is not None for limit in rule[line.name])
    imgui.begin_disabled(both)
    turned = imgui.button(f"{'below' if line.side == BELOW else 'above'}##side", look.vec(_SIDE, 0))
    imgui.end_disabled()
    if turned:
        return replace(line, side=ABOVE if line.side == BELOW else BELOW)
    widgets.tooltip("Click to switch sides")
    imgui.same_line(0, look.px(4))
    imgui.set_next_item_width(look.px(_VALUE))
    low, high = _RANGES.get(line.name, (0.0, 1e6))
    speed = 0.05 if line.name == "photos" else 0.005 * max(abs(line.value), 0.2)
    drag = imgui.drag_float("##value", line.value, speed, low, high, _FORMATS.get(line.name, "%.3f"))
    widgets.tooltip("Drag it, or double-click and type")
    return replace(line, value=round(drag[1], 6)) if drag[0] else None


def _shade(line: Condition, look: Look) -> Condition | None:
    """A colour, and how far off a channel may be."""
    flags = imgui.ColorEditFlags_.no_inputs | imgui.ColorEditFlags_.no_label
    changed, colour = imgui.color_edit3("##shade", list(line.shade[:3]), flags)
    imgui.same_line(0, look.px(8))
    imgui.set_next_item_width(look.px(_SIDE + _VALUE - 26))
    moved, off = imgui.drag_float("##off", line.shade[3], 0.002, 0.0, 1.0, "\u00b1 %.3f")
    widgets.tooltip("How far red, green and blue may be off")
    return replace(line, shade=(*map(float, colour), round(off, 6))) if changed or moved else None


def _limits(preview: Floaters, look: Look) -> list[do.Command]:
    """Within what, and what instead."""
    issued: list[do.Command] = []
    imgui.separator_text("Within")
    imgui.set_next_item_width(-1)
    before = ", ".join(preview.recipe.within)
    _, text = imgui.input_text_with_hint("##within", "anything; or phrases: chair, lamp", before)
    if imgui.is_item_deactivated_after_edit():
        phrases = tuple(each.strip() for each in text.split(",") if each.strip())
        issued.append(clean.ChangeRecipe({"within": phrases}))
    widgets.tooltip("Only within what these phrases find")
    changed, on = widgets.checkbox("Everything else instead", preview.recipe.invert)
    if changed:
        issued.append(clean.ChangeRecipe({"invert": on}))
    widgets.tooltip(
        "What neither strength nor rules find; all outside a box still goes.\n"
        "To remove what is inside a box: Select, then Ctrl+I"
    )
    return issued


def _around(state: State) -> Box:
    """Nearly all of the scene: where a box of one's own begins."""
    info = state.scene.info
    if info is None or info.extent is None:
        return (-1.0, -1.0, -1.0, 1.0, 1.0, 1.0)
    return _in_order(*info.extent, low_moves=False)


def _crop(preview: Floaters, look: Look, around: Box) -> list[do.Command]:
    """The box outside of which all goes."""
    crop, issued = preview.recipe.crop, []
    imgui.separator_text("Outside a box")
    own: tuple[str | Box | None, ...] = ((preview.box or around),)
    options = [("Stays", None), *((name.capitalize(), name) for name in PRESETS), ("By numbers", own[0])]
    chosen = widgets.choice(options, crop)
    if chosen != crop:
        issued.append(clean.ChangeRecipe({"crop": chosen}))
    box = crop if isinstance(crop, tuple) else preview.box
    if crop is None or box is None:
        return issued
    low, high = list(box[:3]), list(box[3:])
    speed = 0.004 * max(max(high) - min(low), _NEAREST)
    for name, corner in (("from", low), ("to", high)):
        imgui.set_next_item_width(-look.px(44))
        moved, values = imgui.drag_float3(f"{name}##box", corner, speed, 0.0, 0.0, "%.2f")
        widgets.tooltip("x, y, z in scene units: drag, or double-click and type")
        if moved:
            first, last = (values, high) if corner is low else (low, values)
            issued.append(clean.ChangeRecipe({"crop": _in_order(first, last, corner is low)}))
    return issued


def _in_order(low: Sequence[float], high: Sequence[float], low_moves: bool) -> Box:
    """The corners, the one that moves stopped at the other."""
    if low_moves:
        low = [min(a, b - _NEAREST) for a, b in zip(low, high, strict=True)]
    else:
        high = [max(b, a + _NEAREST) for a, b in zip(low, high, strict=True)]
    (a, b, c), (d, e, f) = low, high
    return a, b, c, d, e, f


def _files(preview: Floaters, look: Look) -> list[do.Command]:
    """The recipe as a file."""
    issued: list[do.Command] = []
    imgui.separator_text("Recipe")
    imgui.begin_disabled(preview.recipe.empty)
    if imgui.button(f"{fa.ICON_FA_FLOPPY_DISK}  Save ...##recipe"):
        issued.append(do.ShowDialog(Dialog.SAVE_RECIPE))
    widgets.tooltip("To use on other scenes, here or with langflash clean --recipe")
    imgui.end_disabled()
    imgui.same_line()
    if imgui.button(f"{fa.ICON_FA_FOLDER_OPEN}  Load ...##recipe"):
        issued.append(do.ShowDialog(Dialog.LOAD_RECIPE))
    return issued


def draw_box(state: State, place: ImVec2, size: ImVec2, look: Look) -> None:
    """On the picture, in the present window: the edges of the box."""
    preview = state.editing.floaters
    if preview is None or preview.recipe.crop is None:
        return
    crop = preview.recipe.crop
    box = crop if isinstance(crop, tuple) else preview.box
    if box is None:
        return
    canvas, colour = imgui.get_window_draw_list(), widgets.u32(theme.DARK.ACCENT)
    canvas.push_clip_rect(place, ImVec2(place.x + size.x, place.y + size.y), True)
    for start, end in edges_seen(box, state.scene.pose, (size.x, size.y)):
        first, last = (ImVec2(place.x + float(x), place.y + float(y)) for x, y in (start, end))
        canvas.add_line(first, last, widgets.u32(imgui.ImVec4(0, 0, 0, 0.55)), look.px(3.5))
        canvas.add_line(first, last, colour, look.px(1.5))
    canvas.pop_clip_rect()


def edges_seen(box: Box, pose: poses.Pose, size: tuple[float, float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """The twelve edges of a box as pixels (2,) from and to in a picture of `size`, as far as they are in
    front of the camera."""
    corners = np.array([[box[3 * (a >> k & 1) + k] for k in range(3)] for a in range(8)], float)
    matrix, near = poses.viewmat(pose), 1.01 * poses.NEAREST
    depths = corners @ matrix[2, :3] + matrix[2, 3]
    found = []
    for a, b in _EDGES:
        ends = [corners[a], corners[b]]
        if max(depths[a], depths[b]) <= near:
            continue
        for place, (behind, ahead) in enumerate(((a, b), (b, a))):
            if depths[behind] < near:
                share = (near - depths[behind]) / (depths[ahead] - depths[behind])
                ends[place] = corners[behind] + share * (corners[ahead] - corners[behind])
        shown = poses.project(np.array(ends), pose, size)
        if shown is not None:
            found.append((shown[1][0], shown[1][1]))
    return found
