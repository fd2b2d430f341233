"""The dictionary: every atom with its picture, share, name and words, and how alike the atoms are."""

from dataclasses import replace

import numpy as np
from imgui_bundle import ImVec2, imgui, implot
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.base import pictures
from langflash_core.scene.edits import Atom

from ... import commands as do
from ...editing import commands as edit
from ...editing import teaching as teach
from ...kit import boxes, theme, widgets
from ...kit.look import Look
from ...recovery import commands as keep
from ...state import State
from .. import commands as ask
from ..state import Insight

_SIZE = (380.0, 620.0)  # design pixels
_LEAST = (320.0, 240.0)
_LEGEND = 130.0  # that the legend below may need
_MATRIX = implot.Flags_.canvas_only | implot.Flags_.no_frame
_AXIS = implot.AxisFlags_.lock | implot.AxisFlags_.no_grid_lines | implot.AxisFlags_.no_tick_marks


def button(state: State) -> list[do.Command]:
    """Opens the dictionary, or closes it."""
    imgui.begin_disabled(state.scene.info is None or state.scene.info.num_atoms == 0)
    opened = state.preferences.dictionary_open
    label = f"{fa.ICON_FA_BOOK}##dictionary"
    pressed = widgets.primary_button(label) if opened else imgui.button(label)
    imgui.end_disabled()
    widgets.tooltip("The dictionary: what the scene is made of; rename, mute or merge groups")
    return [ask.OpenDictionary(not opened)] if pressed else []


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """The window over the picture, whose corner is `place`."""
    marks, wanted = state.editing.marks, state.preferences
    if not wanted.dictionary_open or state.scene.info is None or marks is None or not marks.atoms:
        return []
    left, top, width, height = wanted.dictionary or _usual(look, place, size)
    display = imgui.get_io().display_size
    extent = ImVec2(min(look.px(width), display.x), min(look.px(height), display.y))
    corner = ImVec2(min(look.px(left), display.x - extent.x), min(look.px(top), display.y - extent.y))
    imgui.set_next_window_pos(ImVec2(max(corner.x, 0), max(corner.y, 0)), imgui.Cond_.appearing)
    imgui.set_next_window_size(extent, imgui.Cond_.appearing)
    imgui.set_next_window_size_constraints(look.vec(*_LEAST), display)
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    flags = imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings
    flags |= imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_scroll_with_mouse
    issued: list[do.Command] = []
    shown, kept = imgui.begin("Dictionary", True, flags)
    if shown and imgui.begin_tab_bar("##tabs"):
        if imgui.begin_tab_item("Groups")[0]:
            issued += _atoms(state, marks.atoms[: marks.there[1]], look)
            imgui.end_tab_item()
        if imgui.begin_tab_item("Similarity")[0]:
            _similarity(state, marks.atoms, look)
            imgui.end_tab_item()
        imgui.end_tab_bar()
    issued += _moved(state, look)
    imgui.end()
    imgui.pop_style_var()
    return issued if kept else [*issued, ask.OpenDictionary(False)]


def _usual(look: Look, place: ImVec2, size: ImVec2) -> tuple[int, ...]:
    """At the picture's right, above the legend, or over the panel where that is narrow; (left, top, width,
    height) in design pixels."""
    aside = boxes.over_panel(place, size, look)
    if aside is not None:
        corner, extent = aside
        left, top, width, height = (side / look.scale for side in (corner.x, corner.y, extent.x, extent.y))
        return round(left), round(top), round(width), round(height)
    across, down = size.x / look.scale, size.y / look.scale
    width, height = min(_SIZE[0], across - 24), max(min(_SIZE[1], down - 24 - _LEGEND), _LEAST[1])
    left = place.x / look.scale + across - width - 12
    return round(left), round(place.y / look.scale + 12), round(width), round(height)


def _moved(state: State, look: Look) -> list[do.Command]:
    """Where the person has put the window, once the hand lets go of it."""
    corner, size = imgui.get_window_pos(), imgui.get_window_size()
    now = tuple(round(side / look.scale) for side in (corner.x, corner.y, size.x, size.y))
    storage, keys = imgui.get_state_storage(), [imgui.get_id(f"side {n}") for n in range(4)]
    moved, before = imgui.get_id("moved"), tuple(storage.get_int(key) for key in keys)
    for key, side in zip(keys, now, strict=True):
        storage.set_int(key, side)
    if now != before and not imgui.is_window_appearing():
        storage.set_bool(moved, True)
    if imgui.is_mouse_down(0) or not storage.get_bool(moved):
        return []
    storage.set_bool(moved, False)
    return [keep.Prefer(replace(state.preferences, dictionary=now))]


def _atoms(state: State, atoms: tuple[Atom, ...], look: Look) -> list[do.Command]:
    """A row for every atom that is not merged into another, the largest first; below it the merging."""
    issued: list[do.Command] = []
    heads = [k for k, atom in enumerate(atoms) if atom.into == k]
    shares = _shares(state.asking.insight, atoms)
    heads.sort(key=lambda k: -shares[k])
    footer = imgui.get_frame_height() + look.px(2) + 2 * imgui.get_style().item_spacing.y
    imgui.begin_child("##rows", ImVec2(0, -footer), imgui.ChildFlags_.nav_flattened)  # keys walk in and out
    for k in heads:
        imgui.push_id(k)
        issued += _row(state, k, atoms, float(shares[k]), look)
        imgui.pop_id()
    imgui.end_child()
    widgets.gap(look.px(2))
    chosen = tuple(k for k in state.asking.chosen if k in heads)
    imgui.begin_disabled(len(chosen) < 2)
    text = f"Merge {len(chosen)} groups" if len(chosen) > 1 else "Merge"
    if widgets.primary_button(f"{fa.ICON_FA_OBJECT_GROUP}  {text}"):
        issued += [edit.MergeAtoms(chosen), ask.ChooseNone()]
    imgui.end_disabled()
    widgets.tooltip("Tick two or more groups to merge; the first keeps its name.  Ctrl+Z undoes")
    imgui.same_line()
    return issued + _others()


def _others() -> list[do.Command]:
    """What leads from scene to scene, at the right of the merging."""
    issued: list[do.Command] = []
    if imgui.button(f"{fa.ICON_FA_BOOKMARK}  Keep names"):
        issued.append(teach.KeepWords())
    widgets.tooltip("Save your names for similar groups in other scenes")
    imgui.same_line()
    if imgui.button(f"{fa.ICON_FA_WAND_MAGIC_SPARKLES}  Take names"):
        issued.append(teach.TakeWords())
    widgets.tooltip("Give groups the names that you saved from similar ones in other scenes.  Ctrl+Z undoes")
    return issued


def _row(state: State, k: int, atoms: tuple[Atom, ...], share: float, look: Look) -> list[do.Command]:
    """Picture | name and share | words, voice and tick."""
    issued = _picture(state, k, look)
    imgui.same_line(0, look.px(10))
    imgui.begin_group()
    start, room = imgui.get_cursor_pos_x(), imgui.get_content_region_avail().x - look.px(6)
    issued += _name(state, k, atoms[k], room, look)
    figure = f"{100 * share:.1f} %"
    widgets.column(start + room - imgui.calc_text_size(figure).x)
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, figure)
    issued += _words(state, k, atoms, start, room, look)
    imgui.end_group()
    return issued


def _name(state: State, k: int, atom: Atom, room: float, look: Look) -> list[do.Command]:
    """A field for the name."""
    issued: list[do.Command] = []
    imgui.set_next_item_width(room - look.px(62))
    with widgets.colours(text=theme.TEXT if atom.on else theme.MUTED):
        changed, name = imgui.input_text_with_hint(
            "##name", state.editing.atom_name(k), atom.name, imgui.InputTextFlags_.enter_returns_true
        )
    if changed or (imgui.is_item_deactivated_after_edit() and name != atom.name):
        issued.append(edit.RenameAtom(k, name))
    widgets.tooltip(f"Group {k}; type a name")
    return issued


def _words(
    state: State, k: int, atoms: tuple[Atom, ...], start: float, room: float, look: Look
) -> list[do.Command]:
    """The nearest words between `start` and `room` beyond it; at their right voice and tick."""
    issued: list[do.Command] = []
    atom, side = atoms[k], imgui.get_frame_height()
    words = ", ".join(state.editing.names[k]) if k < len(state.editing.names) else "..."
    merged = sum(other.into == k for other in atoms) - 1
    tail = f"  +{merged} merged" if merged else ""
    buttons = 2 * side + look.px(14)
    imgui.align_text_to_frame_padding()
    left = room - buttons - look.px(4) - imgui.calc_text_size(tail).x
    imgui.text_colored(theme.MUTED, widgets.shortened(words, left) + tail)
    widgets.column(start + room - buttons)
    voice = fa.ICON_FA_VOLUME_HIGH if atom.on else fa.ICON_FA_VOLUME_XMARK
    tip = "It answers phrases; click to mute it" if atom.on else "Muted; click to let it answer phrases"
    if widgets.quiet_button(f"{voice}##voice", tip):
        issued.append(edit.ToggleAtom(k))
    widgets.column(start + room - side)
    ticked, chosen = widgets.checkbox("##chosen", k in state.asking.chosen)
    widgets.tooltip("Tick to merge")
    if ticked:
        issued.append(ask.ChooseAtom(k, chosen))
    return issued


def _picture(state: State, k: int, look: Look) -> list[do.Command]:
    """What a photo shows of the atom, in a frame of its colour; a click shows its weight map."""
    insight = state.asking.insight
    colour = widgets.rgba(insight.colours[k]) if insight else theme.LINE
    shown = state.scene.mode is pictures.WEIGHT and state.asking.atom == k
    ring = theme.ACCENT if shown else colour
    picture = look.thumbnails.get(f"atom {k}")
    side = 2 * imgui.get_frame_height() + imgui.get_style().item_spacing.y
    with widgets.colours(button=ring, button_hovered=theme.ACCENT, button_active=theme.ACCENT):
        if picture is None:
            pressed = imgui.button("##picture", ImVec2(side, side))
        else:
            imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(3, 3))
            inner = side - look.px(6)
            pressed = imgui.image_button("picture", picture[0], ImVec2(inner, inner))
            imgui.pop_style_var()
    widgets.tooltip("Show where it is")
    return [ask.ShowAtom(k)] if pressed else []


def _shares(insight: Insight | None, atoms: tuple[Atom, ...]) -> np.ndarray:
    """(K,) of the scene, merged atoms counted with their head."""
    own = np.array(insight.shares[: len(atoms)]) if insight else np.zeros(len(atoms))
    return np.bincount([atom.into for atom in atoms], own, minlength=len(atoms))


def _similarity(state: State, atoms: tuple[Atom, ...], look: Look) -> None:
    """Cosines of all pairs, alike atoms side by side."""
    insight = state.asking.insight
    if insight is None:
        widgets.muted("Comparing the groups ...")
        return
    widgets.muted("Cosine of every pair; similar groups are side by side.")
    order = list(insight.order)
    matrix = insight.similarity[np.ix_(order, order)]
    count, room = len(order), imgui.get_content_region_avail()
    scale = look.px(64)
    side = max(min(room.x - scale - look.px(8), room.y - look.px(8)), look.px(120))
    implot.push_colormap(implot.Colormap_.viridis)
    implot.push_style_var(implot.StyleVar_.plot_padding, look.vec(2, 2))
    if implot.begin_plot("##similarity", ImVec2(side, side), _MATRIX):
        bare = _AXIS | implot.AxisFlags_.no_tick_labels
        implot.setup_axes("", "", bare, bare)
        implot.setup_axes_limits(0, count, 0, count, imgui.Cond_.always)
        low, high = implot.Point(0, 0), implot.Point(count, count)
        implot.plot_heatmap("##cosines", np.ascontiguousarray(matrix), -0.2, 1.0, "", low, high)
        if implot.is_plot_hovered():
            at = implot.get_plot_mouse_pos()
            column, row = int(at.x), count - 1 - int(at.y)
            if 0 <= column < count and 0 <= row < count:
                first, second = (state.editing.atom_name(order[i]) for i in (row, column))
                imgui.set_tooltip(f"{first} and {second}: {matrix[row, column]:.2f}")
        implot.end_plot()
    imgui.same_line()
    implot.push_style_var(implot.StyleVar_.plot_padding, look.vec(2, 8))  # half a number at either end
    implot.colormap_scale("##scale", -0.2, 1.0, ImVec2(scale, side), "%.1f")
    implot.pop_style_var(2)
    implot.pop_colormap()
