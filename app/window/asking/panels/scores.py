"""How the pixels of the view score for the active phrase, with its threshold as a line to drag."""

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, imgui, implot
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import commands as ask
from ..reliability import Reliability, reliability
from ..state import BINS, Prompt

if TYPE_CHECKING:
    from langflash_core.types import Scene

_HEIGHT = 78.0  # design pixels
_PLOT = implot.Flags_.canvas_only | implot.Flags_.no_frame
_AXIS = implot.AxisFlags_.no_grid_lines | implot.AxisFlags_.no_tick_marks | implot.AxisFlags_.lock
_BARE = _AXIS | implot.AxisFlags_.no_tick_labels
MIDDLES = np.arange(BINS) / BINS + 0.5 / BINS  # the bins' middles


def draw(state: State, look: Look) -> list[do.Command]:
    """The histogram; nothing before an answer."""
    prompt = state.asking.active_prompt
    found = None if prompt is None else state.asking.histogram(prompt.key, prompt.text)
    if prompt is None or found is None:
        return []
    widgets.gap(look.px(2))
    room = imgui.get_content_region_avail().x - look.px(30)
    title = widgets.shortened(f"Scores of {prompt.text.strip()}", room)
    if not widgets.section(f"{title}###scores"):
        return []
    known = None if state.scene.info is None else _known(state.scene.info.scene)
    issued = _plot(prompt, np.array(found.counts, float), known, look)
    if known is not None and prompt.score is not None and not prompt.otherwise:
        share = 100 * known.at(prompt.score)
        score = f"{prompt.score:.2f}"
        widgets.muted(f"On {known.on}, a score of {score} is right {share:.0f} % of the time.")
    return issued + _span(state, prompt, look)


def _known(scene: "Scene") -> Reliability | None:
    from langflash_core.language.spaces import language_space

    return reliability(scene.record.calibration, language_space(scene.semantics.space).leads().reliability)


def _span(state: State, prompt: Prompt, look: Look) -> list[do.Command]:
    """From where to where the colours of the heat-map reach."""
    low, high = state.heat_colours.ends(prompt.lit_from)
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, "Colours from")
    imgui.same_line()
    reset = look.px(36)
    imgui.set_next_item_width(imgui.get_content_region_avail().x - reset)
    changed, first, last = imgui.drag_float_range2("##span", low, high, 0.005, 0.0, 1.0, "%.2f", "%.2f")
    widgets.tooltip("Relevance of the first and the last colour; drag, or double-click and type")
    imgui.same_line(0, look.px(2))
    imgui.begin_disabled(state.asking.span is None)
    back = widgets.quiet_button(f"{fa.ICON_FA_ROTATE_LEFT}##span", "Set it by the threshold again")
    imgui.end_disabled()
    if back:
        return [ask.SetSpan(None)]
    return [ask.SetSpan((first, last))] if changed else []


def _plot(prompt: Prompt, counts: np.ndarray, known: Reliability | None, look: Look) -> list[do.Command]:
    """Bars as high as the logarithm of their pixels, so that small things show beside a large rest; the
    reliability diagram as a line, from nobody at the bottom to all at the top."""
    issued: list[do.Command] = []
    heights = np.log1p(counts)
    top = max(float(heights.max()), 1.0) * 1.08
    implot.push_style_var(implot.StyleVar_.plot_padding, look.vec(2, 2))
    implot.push_style_color(implot.Col_.plot_bg, theme.CANVAS)
    implot.push_style_color(implot.Col_.plot_border, theme.CANVAS)
    if implot.begin_plot("##scores", ImVec2(-1, look.px(_HEIGHT)), _PLOT):
        implot.setup_axes("", "", _AXIS, _BARE)
        implot.setup_axes_limits(0.0, 1.0, 0.0, top, imgui.Cond_.always)
        implot.setup_axis_ticks(implot.ImAxis_.x1, [0.0, 0.25, 0.5, 0.75, 1.0])
        for passing, alpha in ((prompt.cut > MIDDLES, 0.32), (prompt.cut <= MIDDLES, 0.85)):
            spec = implot.Spec()
            spec.fill_color = widgets.rgba(prompt.colour, alpha)
            spec.line_color = ImVec4Clear
            if passing.any():
                implot.plot_bars("##bars", MIDDLES[passing], heights[passing], 0.9 / BINS, spec)
        if known is not None:
            spec = implot.Spec()
            spec.line_color, spec.line_weight = theme.MUTED, look.px(1.5)
            implot.plot_line("##reliability", np.array(known.scores), top * np.array(known.present), spec)
        moved, cut = _drag_line(prompt.cut, look)
        if moved:
            issued.append(ask.SetThreshold(prompt.key, min(max(cut, 0.0), 1.0)))
        if implot.is_plot_hovered():
            _tip(prompt, counts, known)
        implot.end_plot()
    implot.pop_style_color(2)
    implot.pop_style_var()
    return issued


def _drag_line(cut: float, look: Look) -> tuple[bool, float]:
    """The threshold's line; whether it was moved, and where to. It follows the pointer to where it is let go
    also where that comes in the frame of the last move."""
    moved, cut, _, _, held = implot.drag_line_x(
        1, cut, theme.TEXT, look.px(2), out_clicked=False, out_hovered=False, out_held=False
    )
    storage, holding = imgui.get_state_storage(), imgui.get_id("held")
    if storage.get_bool(holding) and not held and imgui.get_mouse_drag_delta(0).x:
        moved, cut = True, implot.get_plot_mouse_pos().x
    storage.set_bool(holding, bool(held))
    return moved, cut


def _tip(prompt: Prompt, counts: np.ndarray, known: Reliability | None) -> None:
    line = f"\nThe line: how often such a score is right, on {known.on}." if known else ""
    passing = counts[prompt.cut <= MIDDLES].sum() / max(counts.sum(), 1.0)
    imgui.set_tooltip(
        f"{100 * passing:.1f} % of the view scores {prompt.cut:.2f} or more.\n"
        f"Drag the line to change the threshold. Heights are logarithmic.{line}"
    )


ImVec4Clear = widgets.rgba((0.0, 0.0, 0.0), 0.0)
