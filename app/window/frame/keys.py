"""The keys that work everywhere: those of the table, Esc, and the way from area to area."""

from imgui_bundle import imgui

from .. import commands as do
from ..dialogs import Dialog
from ..editing import commands as edit
from ..editing import mending, placing
from ..editing import pointing as point
from ..editing.panels import gizmo
from ..editing.state import Tool
from ..filming import commands as film
from ..inventory import commands as inventory
from ..opening import commands as opening
from ..opening.panels import welcome
from ..scene import commands as show
from ..state import State
from . import table

AREAS = (
    "##session", "##offer", "##panel", "##export", "##toolbar", "##tools", "##bar0", "##bar1", "##bar2",
    "##bar3", "##bar4", "##card", "##ruler", "##keys", "##views", "Dictionary", "Tour", "Inventory", "Rules",
)  # fmt: skip
"""Windows that F6 goes through, by name: questions first."""
_EMPTY = "##picture"
"""One more, where it has tiles to open instead of a scene."""
_PAGES = (imgui.Key.page_up, imgui.Key.page_down)
_ARROWS = (imgui.Key.left_arrow, imgui.Key.right_arrow, imgui.Key.up_arrow, imgui.Key.down_arrow)


def draw(state: State) -> list[do.Command]:
    """Keys that work wherever the pointer is, after all that may take them in this frame."""
    _keep_keys(state)
    if imgui.is_key_pressed(imgui.Key.escape, False) and (state.dialog or not typing()):
        return _escape(state)
    if _covered(state):
        return []
    pressed = [entry for entry in table.ENTRIES if any(_pressed(each, entry.repeats) for each in entry.keys)]
    commands = [entry.make(state) for entry in pressed if entry.in_fields or not typing()]
    return [command for command in commands if command is not None]


def _keep_keys(state: State) -> None:
    """While Ctrl is held the arrows are commands, and the page keys are where there is a tour: they do not
    lead from control to control as well."""
    if typing() or _covered(state):
        return
    kept = _ARROWS if imgui.get_io().key_ctrl else ()
    for key in (*kept, *(_PAGES if state.tour.stops else ())):
        imgui.internal.set_key_owner(key, imgui.get_id("commands"))


def typing() -> bool:
    """Whether a text field has the keys, also one that took them in this very frame."""
    return imgui.get_io().want_text_input or imgui.get_current_context().want_text_input_next_frame == 1


def _pressed(chord: table.Chord, repeats: bool) -> bool:
    """With just what is held beside it; AltGr is Ctrl and Alt, and types a letter."""
    io = imgui.get_io()
    held = (io.key_ctrl, io.key_alt) == (chord.ctrl, False) and (
        io.key_shift == chord.shift or not chord.ctrl
    )
    return held and imgui.is_key_pressed(chord.key, repeats)


def step_to_area(state: State) -> None:
    """F6: the next area, its first control in a frame; Tab does so too where nothing has the focus yet.
    To call before the windows are drawn."""
    context, tab = imgui.get_current_context(), imgui.is_key_pressed(imgui.Key.tab, False)
    lost = tab and not typing() and (context.nav_id == 0 or not imgui.get_io().nav_active)
    if not (lost or imgui.is_key_pressed(imgui.Key.f6, False)) or _covered(state):
        return
    here = context.nav_window.root_window.name if context.nav_window is not None else ""
    areas = (*AREAS, _EMPTY) if welcome.waits(state) else AREAS
    found = {name: imgui.internal.find_window_by_name(name) for name in areas}
    there = [name for name, window in found.items() if window is not None and window.was_active]
    step = 0 if lost else 1
    following = there[(there.index(here) + step) % len(there)] if here in there else there[0]
    imgui.internal.focus_window(found[following])
    imgui.internal.nav_init_window(found[following], True)
    imgui.set_nav_cursor_visible(True)


def _covered(state: State) -> bool:
    """Whether a dialog or a menu has the keys."""
    return bool(state.dialog) or imgui.is_popup_open("", imgui.PopupFlags_.any_popup)


def _escape(state: State) -> list[do.Command]:
    """One step back: a dialog, a menu, a job, an answer, a preview, a tool, the inventory. Never out: one
    press too many would end the program."""
    editing = state.editing
    if state.dialog:
        return [opening.PlaceFound(None) if state.dialog is Dialog.PLACE else do.ShowDialog(None)]
    windows = imgui.get_current_context().windows  # ImGui has shut the menu before this frame was drawn
    if any(window.was_active and window.flags & imgui.WindowFlags_.popup for window in windows):
        return []
    if state.filming.tour is not None:
        return [film.StopTour()]
    if state.scene.job is not None and not state.scene.job.cancelling:
        return [show.CancelJob()]
    if editing.gesture is not None:
        gizmo.let_go()
        return [placing.EndGesture(keep=False)]
    if editing.card is not None or editing.asked is not None:
        return [point.CloseCard()]
    if editing.hiding is not None:
        return [mending.AskToHide("")]
    if editing.floaters is not None:
        return [edit.EndFloaters()]
    if editing.ruler:
        return [point.ClearRuler()]
    if editing.drag:
        return [point.Drag(())]
    if editing.tool is not Tool.MOVE:
        return [point.SetTool(Tool.MOVE)]
    return [inventory.ShowInventory(False)] if state.listing.open else []
