"""The keys that work everywhere."""

from dataclasses import replace

from imgui_bundle import imgui

from .. import commands as do
from ..editing import commands as edit
from ..editing import pointing as point
from ..editing.state import Tool
from ..exporting import commands as export
from ..recovery import commands as keep
from ..scene import camera
from ..scene import commands as show
from ..scene.panels import in_space
from ..scene.panels.modes import KEYED
from ..state import State

_DIGITS = (
    imgui.Key._1, imgui.Key._2, imgui.Key._3, imgui.Key._4, imgui.Key._5,
    imgui.Key._6, imgui.Key._7, imgui.Key._8, imgui.Key._9, imgui.Key._0,
)  # fmt: skip
_MODE_KEYS = tuple(zip(_DIGITS, KEYED, strict=True))

_EDIT_CHORDS: tuple[tuple[imgui.Key, bool, do.Command], ...] = (  # with Ctrl; whether with Shift
    (imgui.Key.z, False, edit.Undo()), (imgui.Key.z, True, edit.Redo()), (imgui.Key.y, False, edit.Redo()),
    (imgui.Key.a, False, edit.SelectAll()), (imgui.Key.d, False, edit.Deselect()),
    (imgui.Key.i, False, edit.Invert()),
)  # fmt: skip
_TOOL_KEYS = (
    (imgui.Key.v, Tool.MOVE), (imgui.Key.x, Tool.POINT), (imgui.Key.r, Tool.BOX),
    (imgui.Key.b, Tool.BRUSH), (imgui.Key.c, Tool.PICK),
)  # fmt: skip
_DOING_KEYS: tuple[tuple[imgui.Key, do.Command], ...] = (
    (imgui.Key.delete, edit.Delete()), (imgui.Key.backspace, edit.Delete()), (imgui.Key.g, edit.Grow()),
    (imgui.Key.f, point.FrameSelection()),
)  # fmt: skip
BRUSH_STEP = 1.15  # of its radius, per press of [ or ]
_CHORDS: tuple[tuple[imgui.Key, do.Command], ...] = (
    (imgui.Key.s, do.ShowDialog("save")), (imgui.Key.o, do.ShowDialog("open")), (imgui.Key.q, do.Leave()),
    (imgui.Key.e, export.ShowExport()), (imgui.Key.p, do.ShowDialog("settings")),
)  # fmt: skip


def draw(state: State) -> list[do.Command]:
    """Keys that work wherever the pointer is."""
    io = imgui.get_io()
    issued = _chords(state)
    if imgui.is_key_pressed(imgui.Key.f1, False):
        issued.append(do.ShowDialog("help"))
    if imgui.is_key_pressed(imgui.Key.f2, False):
        issued.append(do.ShowDialog("log"))
    if imgui.is_key_pressed(imgui.Key.escape, False) and not typing():
        issued += _escape(state)
    if typing() or io.key_ctrl or state.dialog or state.info is None:
        return issued
    if imgui.is_key_pressed(imgui.Key.h, False) or imgui.is_key_pressed(imgui.Key.home, False):
        issued.append(camera.Home())
    if imgui.is_key_pressed(imgui.Key.z, False):
        issued.append(camera.FrameAll())
    if imgui.is_key_pressed(imgui.Key.p, False) and state.view is not None:
        issued.append(camera.Compare(None if in_space.comparing(state) else 0.5))
    if imgui.is_key_pressed(imgui.Key.k, False):
        wanted = state.preferences
        issued.append(keep.Prefer(replace(wanted, photos_in_space=not wanted.photos_in_space)))
    issued += [camera.SetMode(mode) for key, mode in _MODE_KEYS if imgui.is_key_pressed(key, False)]
    issued += [point.SetTool(tool) for key, tool in _TOOL_KEYS if imgui.is_key_pressed(key, False)]
    issued += [command for key, command in _DOING_KEYS if imgui.is_key_pressed(key, False)]
    if imgui.is_key_pressed(imgui.Key.left_bracket):
        issued.append(point.SetRadius(state.editing.radius / BRUSH_STEP))
    if imgui.is_key_pressed(imgui.Key.right_bracket):
        issued.append(point.SetRadius(state.editing.radius * BRUSH_STEP))
    return issued


def typing() -> bool:
    """Whether a text field has the keys, also one that took them in this very frame."""
    return imgui.get_io().want_text_input or imgui.get_current_context().want_text_input_next_frame == 1


def _chords(state: State) -> list[do.Command]:
    """With Ctrl; AltGr is Ctrl and Alt, and types a letter."""
    io = imgui.get_io()
    if not io.key_ctrl or io.key_alt or state.dialog:
        return []
    issued = [command for key, command in _CHORDS if imgui.is_key_pressed(key, False)]
    if typing():
        return issued
    return issued + [
        command
        for key, shift, command in _EDIT_CHORDS
        if shift == io.key_shift and imgui.is_key_pressed(key, False)
    ]


def _escape(state: State) -> list[do.Command]:
    """One step back: a dialog, a menu, a job, an answer, a preview, a tool. Never out: one press too many
    would end the program."""
    editing = state.editing
    if state.dialog:
        return [do.ShowDialog(None)]
    if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        imgui.internal.close_popups_except_modals()
        return []
    if state.job is not None and not state.job.cancelling:
        return [show.CancelJob()]
    if editing.card is not None or editing.asked is not None:
        return [point.CloseCard()]
    if editing.floaters is not None:
        return [edit.EndFloaters()]
    return [] if editing.tool is Tool.MOVE else [point.SetTool(Tool.MOVE)]
