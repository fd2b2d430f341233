"""The questions: one row per phrase with its colour, score and threshold; the negatives below."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...editing import commands as edit
from ...kit import theme, widgets
from ...kit.look import Look
from ...scene import camera
from ...scene import commands as show
from ...state import State
from .. import commands as ask
from .. import lifting
from ..state import Prompt, usable
from . import entry, known, parts, scores

_SWATCH = imgui.ColorEditFlags_.no_inputs | imgui.ColorEditFlags_.no_label | imgui.ColorEditFlags_.no_tooltip


def draw(state: State, look: Look) -> list[do.Command]:
    """The prompts section."""
    issued: list[do.Command] = []
    widgets.heading("Find")
    issued += _offer(state, look)
    for prompt in state.asking.prompts:
        imgui.push_id(prompt.key)
        issued += _row(state, prompt, look)
        imgui.pop_id()
    issued += entry.tools(state, look)
    first = not state.asking.asked or widgets.high(look)
    if first:  # what there is to ask
        issued += known.draw(state, look)
    issued += scores.draw(state, look)
    issued += parts.draw(state, look)  # they come later, and must not move what is above them
    if not first:  # in a low window answers, which it would push out
        issued += known.draw(state, look)
    widgets.gap(look.px(2))
    issued += _negatives(state)
    return issued


def _offer(state: State, look: Look) -> list[do.Command]:
    """To teach phrases to a scene that knows none; how far that is, and its end."""
    job = state.scene.job
    if state.scene.info is None or state.scene.info.num_atoms:
        return []
    widgets.muted(lifting.CANNOT)
    if job is not None and job.title == lifting.TEACHING:
        pressed = imgui.button(f"{fa.ICON_FA_STOP}  Cancel##teaching")
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        widgets.muted(f"{job.title}: {job.fraction:.0%}")
        return [show.CancelJob()] if pressed else []
    imgui.begin_disabled(job is not None)
    pressed = widgets.primary_button(f"{fa.ICON_FA_GRADUATION_CAP}  Teach it ({lifting.ABOUT})")
    imgui.end_disabled()
    widgets.tooltip("Looks at it from where people would stand; Ctrl+Z takes it back")
    widgets.gap(look.px(2))
    return [lifting.TeachPhrases()] if pressed else []


def _row(state: State, prompt: Prompt, look: Look) -> list[do.Command]:
    corner = imgui.get_cursor_screen_pos()
    issued = _phrase(state, prompt, look)
    issued += _row_buttons(state, prompt, look)
    if prompt.text.strip() and prompt.visible and state.scene.info is not None and state.scene.info.num_atoms:
        issued += _verdict(state, prompt, look)
    shown = state.asking.active_prompt
    if shown is not None and shown.key == prompt.key and len(state.asking.asked) > 1:
        end = ImVec2(corner.x - look.px(6), imgui.get_cursor_screen_pos().y - look.px(10))
        start = ImVec2(end.x - look.px(3), corner.y)
        imgui.get_window_draw_list().add_rect_filled(start, end, widgets.u32(theme.ACCENT), look.px(2))
    return issued


def _phrase(state: State, prompt: Prompt, look: Look) -> list[do.Command]:
    """Its colour and its words."""
    issued: list[do.Command] = []
    changed, colour = imgui.color_edit3("##colour", list(prompt.colour), _SWATCH)
    if changed:
        red, green, blue = colour
        issued.append(ask.ColourPrompt(prompt.key, (red, green, blue)))
    imgui.same_line()
    imgui.set_next_item_width(imgui.get_content_region_avail().x - 3 * look.px(38))
    frame = theme.LINE if prompt.like else theme.RAISED  # a chip that stands for a place, not for its words
    if state.asking.caret == prompt.key:
        imgui.set_keyboard_focus_here()
        issued.append(ask.CaretTaken())
    with widgets.colours(frame_bg=frame):
        changed, text = entry.field(state, prompt)
    issued += entry.finished(prompt.key, text)
    if prompt.like:
        widgets.tooltip("Finds what looks like the place you clicked; type to search for words instead")
    if imgui.is_item_activated() and state.asking.active != prompt.key:
        issued.append(ask.SelectPrompt(prompt.key))
    if changed and not imgui.is_key_pressed(imgui.Key.escape):  # ImGui would take back what was typed
        issued.append(ask.EditPrompt(prompt.key, text))
    return issued


def _row_buttons(state: State, prompt: Prompt, look: Look) -> list[do.Command]:
    """Ask or not, select what it means, remove."""
    issued: list[do.Command] = []
    imgui.same_line(0, look.px(2))
    eye = fa.ICON_FA_EYE if prompt.visible else fa.ICON_FA_EYE_SLASH
    if widgets.quiet_button(f"{eye}##eye", "Show or hide this answer"):
        issued.append(ask.ShowPrompt(prompt.key, not prompt.visible))
    imgui.same_line(0, look.px(2))
    tip = "Select what this phrase found; Shift adds, Ctrl removes"
    if widgets.quiet_button(f"{fa.ICON_FA_DRAW_POLYGON}##select", tip) and prompt.text.strip():
        issued.append(edit.SelectByPhrase(prompt.key, widgets.combined(state.editing.combine)))
    imgui.same_line(0, look.px(2))
    if widgets.quiet_button(f"{fa.ICON_FA_XMARK}##remove", "Remove"):
        issued.append(ask.RemovePrompt(prompt.key))
    return issued


def _verdict(state: State, prompt: Prompt, look: Look) -> list[do.Command]:
    """Found or not with the score, then the threshold slider."""
    issued: list[do.Command] = []
    imgui.indent(look.px(36))
    if not usable(prompt.text):
        entry.unfinished_hint()
        imgui.unindent(look.px(36))
        return issued
    imgui.align_text_to_frame_padding()
    if prompt.score is None:
        imgui.text_colored(theme.MUTED, "...")
    elif prompt.found:
        imgui.text_colored(theme.GOOD, f"{fa.ICON_FA_CHECK} found")
    elif prompt.maybe:
        imgui.text_colored(theme.ACCENT, f"{fa.ICON_FA_QUESTION} maybe")
        widgets.tooltip("Almost: the nearest match is ringed faintly in the picture")
    else:
        imgui.text_colored(theme.BAD, f"{fa.ICON_FA_XMARK} not found")
    if prompt.score is not None:
        imgui.same_line()
        imgui.text_colored(theme.MUTED, f"{prompt.score:.2f}")
    imgui.same_line(look.px(182))
    reset = look.px(30)
    width = imgui.get_content_region_avail().x - reset
    tip = "Threshold: found from this score on"
    changed, cut = widgets.slider("##threshold", prompt.cut, (0.0, 1.0), f"{prompt.cut:.2f}", tip, width)
    if changed:
        issued.append(ask.SetThreshold(prompt.key, cut))
    imgui.same_line(0, look.px(2))
    imgui.begin_disabled(prompt.threshold is None)
    if widgets.quiet_button(f"{fa.ICON_FA_ROTATE_LEFT}##calibrated", "Back to the calibrated threshold"):
        issued.append(ask.SetThreshold(prompt.key, None))
    imgui.end_disabled()
    if prompt.found is False and prompt.photo not in (None, state.scene.view) and not prompt.otherwise:
        what = prompt.reading.partition(",")[0]  # of "wall, purple" only a wall is known to be there
        if imgui.small_button(f"Photo {prompt.photo + 1} shows {what or 'it'}##where"):
            issued.append(camera.JumpTo(prompt.photo))
        widgets.tooltip(f"Go to the photo that shows most of {what or 'it'}")
    if prompt.reading:
        issued += _reading(prompt, look)
    if prompt.note:
        widgets.muted(f"{prompt.note[:1].upper()}{prompt.note[1:]}.".replace("?.", "?"))
    imgui.unindent(look.px(36))
    return issued


def _reading(prompt: Prompt, look: Look) -> list[do.Command]:
    """How the words are understood; a click takes that away."""
    tip = "Search for exactly these words, in quotes"
    away = widgets.quiet_button(f"{fa.ICON_FA_XMARK}##whole", tip)
    imgui.same_line(0, look.px(4))
    imgui.align_text_to_frame_padding()
    widgets.muted(f"Read as: {prompt.reading}")
    return [ask.AskWhole(prompt.key)] if away else []


def _negatives(state: State) -> list[do.Command]:
    issued: list[do.Command] = []
    if not widgets.section("Compared with", opened=False):
        return []
    widgets.muted("A phrase is found where it fits better than all of these (separated by commas).")
    imgui.set_next_item_width(-1)
    changed, text = imgui.input_text("##negatives", ", ".join(state.asking.negatives or state.asking.usual))
    if changed:
        issued.append(ask.SetNegatives(tuple(part.strip() for part in text.split(",") if part.strip())))
    if state.asking.negatives and imgui.button("Back to the defaults"):
        issued.append(ask.SetNegatives(()))
    return issued
