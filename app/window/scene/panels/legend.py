"""Over the picture's lower right corner: what its colours mean."""

from imgui_bundle import ImVec2, ImVec4, imgui

from ...asking.state import margin_span
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from ..state import Mode
from . import tray

_WIDTH = 244.0  # design pixels
_MARGIN = 12.0
_VIEWS = 78.0
_ATOMS_NAMED = 6
_FLAGS = widgets.PLAIN | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.no_focus_on_appearing


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> None:
    """The legend of the present mode; nothing for plain colours."""
    if state.info is None or state.mode is Mode.RGB:
        return
    raised = look.px(_VIEWS) if covers_views(size.x / look.scale, len(state.info.views)) else 0.0
    corner = ImVec2(place.x + size.x - look.px(_MARGIN), place.y + size.y - look.px(_MARGIN) - raised)
    imgui.set_next_window_pos(corner, 0, ImVec2(1, 1))
    imgui.set_next_window_size(ImVec2(look.px(_WIDTH), 0))
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    imgui.push_style_var(imgui.StyleVar_.window_padding, look.vec(12, 10))
    ground = imgui.get_style().color_(imgui.Col_.popup_bg)
    with widgets.colours(window_bg=ImVec4(ground.x, ground.y, ground.z, 0.88)):
        imgui.begin("##legend", None, _FLAGS)
        _body(state, look)
        imgui.end()
    imgui.pop_style_var(2)


def covers_views(width: float, count: int) -> bool:
    """Whether it would lie on the buttons of so many viewpoints, in a picture so wide, design pixels."""
    return width < _WIDTH + 2 * _MARGIN + 16 + 84 * count + 80


def _body(state: State, look: Look) -> None:
    mode = state.mode
    if not mode.possible(state.info):
        widgets.muted("This scene has no data for it.")
    elif mode.answers and not state.asked:
        widgets.muted("Type a phrase to see this.")
    elif mode is Mode.HEAT:
        prompt = state.active_prompt
        assert prompt is not None
        low, high = state.heat_colours.ends(prompt.cut)
        _bar(prompt.text, state.preferences.colormap, _numbers(low, high), look)
    elif mode is Mode.MARGIN:
        _margin(state, look)
    elif mode in (Mode.LABELS, Mode.MASKS, Mode.ISOLATE, Mode.HIDE, Mode.DIM):
        _prompts(state, look)
    elif mode is Mode.DEPTH:
        near, far = state.stats.depth_range
        middle = 2 / (1 / max(near, 1e-9) + 1 / max(far, 1e-9))
        _bar(
            "Depth, scene units",
            state.preferences.colormap,
            (f"{far:.2f}", f"{middle:.2f}", f"{near:.2f}"),
            look,
        )
    elif mode is Mode.WEIGHT:
        _bar(
            f"Weight of {state.editing.atom_name(state.asking.atom)}",
            state.preferences.colormap,
            ("0", "0.5", "1"),
            look,
        )
    elif mode is Mode.TRANSMITTANCE:
        _bar("Light that passes every splat", state.preferences.colormap, ("0", "0.5", "1"), look)
    elif mode is Mode.FEATURES:
        widgets.muted("The three main axes of the language features, as red, green and blue.")
    elif mode is Mode.ATOMS:
        _atoms(state, look)
    elif mode in (Mode.COVERAGE, Mode.AGREEMENT):
        _trust(state, look)
    else:
        widgets.muted(mode.value)


def _margin(state: State, look: Look) -> None:
    low, high = margin_span(len(state.asked))
    alone = len(state.asked) == 1
    title = f"{state.asked[0].text}, over its threshold" if alone else "Best phrase over the second best"
    _bar(title, state.preferences.colormap, _numbers(low, high), look)


def _numbers(low: float, high: float) -> tuple[str, ...]:
    return tuple(f"{value:.2f}" for value in (low, (low + high) / 2, high))


def _bar(title: str, colormap: str, numbers: tuple[str, ...], look: Look) -> None:
    """A colour-bar with numbers below it, evenly spread."""
    _fitted(title)
    width = imgui.get_content_region_avail().x
    picture = look.thumbnails.get(f"bar {colormap}")
    if picture is not None:
        imgui.image(picture[0], ImVec2(width, look.px(10)))
    start = imgui.get_cursor_pos_x()
    for place, number in enumerate(numbers):
        share = place / (len(numbers) - 1)
        if place:
            imgui.same_line()
        imgui.set_cursor_pos_x(start + share * (width - imgui.calc_text_size(number).x))
        imgui.text_colored(theme.MUTED, number)


def _prompts(state: State, look: Look) -> None:
    for prompt in state.asked:
        _swatch(prompt.colour, look)
        mark = "" if prompt.found is None or prompt.found else "  (not found)"
        _fitted(prompt.text.strip() + mark, theme.MUTED if mark else theme.TEXT)


def _atoms(state: State, look: Look) -> None:
    insight = state.asking.insight
    if insight is None or not insight.shares:
        widgets.muted("Every group of the dictionary in its own colour.")
        return
    largest = sorted(range(len(insight.shares)), key=lambda k: -insight.shares[k])[:_ATOMS_NAMED]
    for k in largest:
        _swatch(insight.colours[k], look)
        _fitted(state.editing.atom_name(k))


def _trust(state: State, look: Look) -> None:
    from ....gl.display import COUNT_COLOURS  # loads torch; the worker has by now
    from ....gl.photos import WORST

    if state.mode is Mode.COVERAGE:
        names = ("seen by no photo", "by one photo", "by two or more")
        for colour, name in zip(COUNT_COLOURS, names, strict=True):
            _swatch(colour, look)
            imgui.text(name)
    else:
        numbers = ("0 %", f"{50 * WORST:.0f} %", f"{100 * WORST:.0f} %")
        _bar("Photos disagree on depth by", state.preferences.colormap, numbers, look)
        _swatch((0.3, 0.3, 0.3), look)
        imgui.text_colored(theme.MUTED, "fewer than two can tell")
    assert state.info is not None
    for sentence in tray.sentences(state.info.warnings)[:2]:
        widgets.muted(sentence)


def _swatch(colour: tuple[float, float, float], look: Look) -> None:
    side, line = look.px(12), imgui.get_text_line_height()
    corner = imgui.get_cursor_screen_pos()
    top = corner.y + (line - side) / 2
    end = ImVec2(corner.x + side, top + side)
    fill = widgets.u32(widgets.rgba(colour))
    imgui.get_window_draw_list().add_rect_filled(ImVec2(corner.x, top), end, fill, look.px(3))
    imgui.dummy(ImVec2(side, line))
    imgui.same_line()


def _fitted(text: str, colour: ImVec4 | None = None) -> None:
    imgui.text_colored(colour or theme.TEXT, widgets.shortened(text, imgui.get_content_region_avail().x))
