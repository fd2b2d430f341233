"""The export dialog, and the export under way."""

import math
from dataclasses import replace

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.base.outputs import OFFERED, ROOM

from .. import commands as do
from ..dialogs import Dialog
from ..filming.state import WAYS
from ..kit import theme, widgets
from ..kit.look import Look
from ..kit.widgets import Answer
from ..opening import commands as opening
from ..scene.near import photos_known
from ..state import State
from . import commands as export
from . import order as written
from .state import SECONDS, ExportForm

WIDTH = 620.0  # design pixels
HEIGHT = 740.0  # of the kinds that need most, with a command of three lines
PROGRESS = 112.0  # the same, high: what `draw_progress` needs
COLUMNS = 4
_NAMED = 6  # files that the question before a replacement names
SIDES = (512, 1024, 1600, 2048, 4096)


def draw(state: State, look: Look) -> list[do.Command]:
    """The dialog's body; in a low window it scrolls, and its buttons stay."""
    room = widgets.above_buttons(look.px(24), look.px(60))
    flags = imgui.ChildFlags_.auto_resize_y | imgui.ChildFlags_.nav_flattened  # keys walk in and out
    imgui.set_next_window_size_constraints(ImVec2(0, 0), ImVec2(math.inf, room))
    imgui.begin_child("##form", ImVec2(0, 0), flags)
    issued, confirmed = _form(state, look)
    imgui.end_child()
    return issued + _buttons(state, look, confirmed)


def _form(state: State, look: Look) -> tuple[list[do.Command], bool]:
    """What is wanted, and the command that it is; the second value tells whether Enter has ended its path."""
    form = state.exporting.form
    wanted = _kinds(form, look)
    widgets.muted(form.what.tip)
    widgets.gap(look.px(4))
    wanted = _options(state, wanted, look)
    widgets.gap(look.px(4))
    imgui.text("Save as")
    imgui.set_next_item_width(-widgets.folder_room())
    _, path = imgui.input_text("##file", wanted.path)
    confirmed = widgets.confirmed()
    elsewhere: list[do.Command] = [opening.LookForPlace()] if widgets.folder_button() else []
    wanted = replace(wanted, path=path)
    issued: list[do.Command] = [] if wanted == form else [export.EditForm(wanted)]
    return issued + elsewhere + _order(state, look), confirmed


def _kinds(form: ExportForm, look: Look) -> ExportForm:
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - (COLUMNS - 1) * spacing) / COLUMNS
    for index, what in enumerate(ROOM if form.what in ROOM else OFFERED):
        if index % COLUMNS:
            imgui.same_line()
        for chosen in widgets.press(what.label, what, size=ImVec2(width, 0), on=what is form.what):
            form = replace(form, what=chosen)
    return form


def _options(state: State, form: ExportForm, look: Look) -> ExportForm:
    what = form.what
    if what.looks:
        _label("Seen from", look)
        count = len(state.scene.info.views) if state.scene.info else 0
        options = (("this view", False), (f"all {count} photos", True))
        form = replace(form, all_views=widgets.choice(options, form.all_views))
    if what.sized:
        _label("Longer side", look)
        form = replace(form, side=widgets.choice([(str(side), side) for side in SIDES], form.side))
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        imgui.text_colored(theme.MUTED, "px")
    if what.moves:
        _label("Goes", look)
        shown = written.way(state)
        chosen = widgets.choice(WAYS, shown)
        form = replace(form, way=chosen if chosen != shown else form.way)
        _label("Length", look)
        width = imgui.get_content_region_avail().x
        changed, seconds = widgets.slider(
            "##seconds", form.seconds, SECONDS, f"{form.seconds:.0f} s", "", width
        )
        if changed:
            form = replace(form, seconds=float(round(seconds)))
    if what.fades and photos_known(state):
        changed, fade = widgets.checkbox("Fade what no photo saw", written.fades(state))
        if changed:
            form = replace(form, fade=fade)
    return _narrowed(state, form, look)


def _label(text: str, look: Look) -> None:
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    imgui.same_line(look.px(110))


def _narrowed(state: State, form: ExportForm, look: Look) -> ExportForm:
    """To what the phrases find, or to what is selected."""
    what = form.what
    if what.takes_phrases and not what.needs_phrases:
        imgui.begin_disabled(not state.asking.asked)
        changed, only = widgets.checkbox("Only what the phrases find", form.only_found)
        imgui.end_disabled()
        if changed:
            form = replace(form, only_found=only)
    if what.splats:
        imgui.same_line(0, look.px(26))
        imgui.begin_disabled(state.exporting.selection is None)
        changed, only = widgets.checkbox("Only what is selected", form.only_selected)
        imgui.end_disabled()
        if changed:
            form = replace(form, only_selected=only)
    return form


def _order(state: State, look: Look) -> list[do.Command]:
    """The command that will run, or why there is none."""
    order = written.order(state)
    if isinstance(order, str):
        widgets.muted(order)
        return []
    widgets.muted("As a command:")
    _command_line(order.request.line, look)
    imgui.same_line()
    copied = widgets.quiet_button(f"{fa.ICON_FA_COPY}##line", "Copy the command line")
    for remark in written.remarks(state):
        widgets.muted(remark)
    widgets.gap(look.px(4))
    return [do.CopyText(order.request.line)] if copied else []


def _buttons(state: State, look: Look, confirmed: bool) -> list[do.Command]:
    """What runs it, and what closes the dialog."""
    issued: list[do.Command] = []
    busy = state.exporting.running is not None
    imgui.begin_disabled(isinstance(written.order(state), str) or busy)
    if widgets.default_button("Export", look.vec(120, 0), confirmed):
        issued.append(export.Export())
    imgui.end_disabled()
    imgui.same_line()
    issued += widgets.press("Close", do.ShowDialog(None), size=look.vec(120, 0))
    if busy:
        imgui.same_line()
        imgui.text_colored(theme.MUTED, "an export is running")
    return issued


def draw_replacing(state: State, look: Look) -> list[do.Command]:
    """The question before files are written over."""
    there = state.exporting.there
    alone = len(there) == 1
    imgui.text_wrapped("This file already exists:" if alone else "These files already exist:")
    for file in there[:_NAMED]:
        widgets.muted(str(file))
    if len(there) > _NAMED:
        widgets.muted(f"and {len(there) - _NAMED} more")
    widgets.gap(look.px(4))
    return widgets.answers(
        look,
        Answer("Replace it" if alone else "Replace them", 140, export.Export(sure=True)),
        Answer("Choose another name", 190, do.ShowDialog(Dialog.EXPORT)),
    )


def _command_line(line: str, look: Look) -> None:
    padding = look.px(8)
    width = imgui.get_content_region_avail().x - look.px(44)
    extent = imgui.calc_text_size(line, False, width - 2 * padding)
    corner = imgui.get_cursor_screen_pos()
    end = ImVec2(corner.x + width, corner.y + extent.y + 2 * padding)
    imgui.get_window_draw_list().add_rect_filled(corner, end, widgets.u32(theme.RAISED), look.px(6))
    imgui.set_cursor_screen_pos(ImVec2(corner.x + padding, corner.y + padding))
    imgui.push_text_wrap_pos(imgui.get_cursor_pos_x() + width - 2 * padding)
    imgui.text_unformatted(line)
    imgui.pop_text_wrap_pos()
    imgui.set_cursor_screen_pos(corner)
    imgui.dummy(ImVec2(width, extent.y + 2 * padding))


def draw_progress(state: State, look: Look) -> list[do.Command]:
    """The export under way, in a window of its own, `PROGRESS` high; nothing without one."""
    now = state.exporting.running
    if now is None:
        return []
    imgui.separator()
    widgets.gap(look.px(2))
    told = now.told(state.now)
    room = imgui.get_content_region_avail().x - imgui.calc_text_size(f"{told}   ").x
    imgui.text_unformatted(widgets.shortened(f"Exporting {now.target.name}", room))
    with widgets.colours(text=theme.MUTED):
        widgets.at_right_edge(told)
    fraction = now.fraction if now.fraction >= 0 else -0.6 * state.now
    imgui.progress_bar(fraction, ImVec2(-1, look.px(8)), "")
    stop, wide = f"{fa.ICON_FA_STOP}  Stop the export", ImVec2(-1, 0)
    return widgets.press(stop, export.CancelExport(), size=wide, able=not now.cancelling)
