"""Around the prompts: a field that recalls phrases, and the row that adds, recalls, saves and loads."""

from imgui_bundle import icons_fontawesome_6 as fa
from imgui_bundle import imgui

from ... import commands as do
from ...dialogs import Dialog
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import commands as ask
from ..prompt_sets import MOST_PROMPTS
from ..state import Prompt

HINT = "a thing, e.g. armchair"
ALGEBRA = "Phrases can be added and subtracted:\nsofa + cushion\nchair - armchair\nPut spaces around + and -."
_FLAGS = imgui.InputTextFlags_.callback_history


def field(state: State, prompt: Prompt) -> tuple[bool, str]:
    """The prompt's text; arrow up and down go through the recent phrases. Whether it changed, and to what."""
    storage, place = imgui.get_state_storage(), imgui.get_id("recalled")
    recent = state.asking.recent

    def recall(data: imgui.InputTextCallbackData) -> int:
        step = 1 if data.event_key == imgui.Key.up_arrow else -1
        at = min(max(storage.get_int(place, -1) + step, -1), len(recent) - 1)
        storage.set_int(place, at)
        data.delete_chars(0, data.buf_text_len)
        data.insert_chars(0, recent[at] if at >= 0 else "")
        return 0

    _reload(prompt.text)
    changed, text = imgui.input_text_with_hint("##text", HINT, prompt.text, _FLAGS, recall)
    if imgui.is_item_activated():
        storage.set_int(place, -1)
    return changed, text


def _reload(text: str) -> None:
    """Where a command has set another text than the field with the caret holds, the command wins: the field
    keeps its own until it is told."""
    held = imgui.internal.get_input_text_state(imgui.get_id("##text"))
    if held is not None and imgui.internal.get_active_id() == held.id_ and held.get_text() != text:
        held.reload_user_buf_and_move_to_end()


def finished(key: int, text: str) -> list[do.Command]:
    """To call after the field of prompt `key`: what was typed there becomes a recent phrase, and Enter goes
    on to the next one."""
    if not text.strip() or not imgui.is_item_deactivated():
        return []
    issued: list[do.Command] = [ask.Remember(text)] if imgui.is_item_deactivated_after_edit() else []
    if imgui.is_key_pressed(imgui.Key.enter) or imgui.is_key_pressed(imgui.Key.keypad_enter):
        issued.append(ask.NextPrompt(key))
    return issued


def unfinished_hint() -> None:
    """Instead of a verdict, while a phrase is missing."""
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, "write a phrase on both sides of + and -")


def tools(state: State, look: Look) -> list[do.Command]:
    """Add a phrase; recent ones; a set from a file or into one; how to combine phrases."""
    issued: list[do.Command] = []
    full = len(state.asking.prompts) >= MOST_PROMPTS
    imgui.begin_disabled(full)
    if imgui.button(f"{fa.ICON_FA_PLUS}  Add a phrase"):
        issued.append(ask.AddPrompt())
    imgui.end_disabled()
    widgets.tooltip("Or press Enter in a phrase")
    imgui.same_line(0, look.px(6))
    imgui.begin_disabled(not state.asking.recent)
    if widgets.quiet_button(f"{fa.ICON_FA_CLOCK_ROTATE_LEFT}##recent", "Recent phrases  (Up in a phrase)"):
        imgui.open_popup("recent")
    imgui.end_disabled()
    imgui.same_line(0, look.px(2))
    if widgets.quiet_button(f"{fa.ICON_FA_FILE_IMPORT}##load", "Load a set of phrases"):
        issued.append(do.ShowDialog(Dialog.LOAD_PROMPTS))
    imgui.same_line(0, look.px(2))
    imgui.begin_disabled(not any(p.text.strip() for p in state.asking.prompts))
    if widgets.quiet_button(f"{fa.ICON_FA_FILE_EXPORT}##save", "Save these phrases as a set"):
        issued.append(do.ShowDialog(Dialog.SAVE_PROMPTS))
    imgui.end_disabled()
    imgui.same_line(0, look.px(2))
    widgets.quiet_button(f"{fa.ICON_FA_PLUS_MINUS}##algebra", ALGEBRA)
    return issued + _recent(state, look)


def _recent(state: State, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.push_style_var(imgui.StyleVar_.window_padding, look.vec(12, 10))
    if imgui.begin_popup("recent"):
        for place, text in enumerate(state.asking.recent[:12]):
            if imgui.selectable(f"{widgets.shortened(text, look.px(260))}##{place}", False)[0]:
                issued.append(ask.AskAgain(text))
        imgui.end_popup()
    imgui.pop_style_var()
    return issued
