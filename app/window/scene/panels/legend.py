"""Over the picture's lower right corner: what its colours mean."""

from collections.abc import Callable
from dataclasses import dataclass

from imgui_bundle import ImVec2, ImVec4, imgui

from langflash_core.base.pictures import Colour, Facts, Legend

from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from ..state import possible
from . import tray
from .places import FEWEST

_WIDTH = 244.0  # design pixels
_MARGIN = 12.0
_VIEWS = 78.0
_ATOMS_NAMED = 6
_FLAGS = widgets.PLAIN | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.no_focus_on_appearing


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> None:
    """The legend of the present mode; nothing for plain colours."""
    if state.scene.info is None or state.scene.mode.legend is None:
        return
    raised = look.px(_VIEWS) if covers_views(size.x / look.scale, len(state.scene.info.views)) else 0.0
    corner = ImVec2(place.x + size.x - look.px(_MARGIN), place.y + size.y - look.px(_MARGIN) - raised)
    imgui.set_next_window_pos(corner, 0, ImVec2(1, 1))
    imgui.set_next_window_size(ImVec2(look.px(_WIDTH), 0))
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    imgui.push_style_var(imgui.StyleVar_.window_padding, look.vec(12, 10))
    ground = imgui.get_style().color_(imgui.Col_.popup_bg)
    with widgets.colours(window_bg=ImVec4(ground.x, ground.y, ground.z, 0.88)):
        imgui.begin("##legend", None, _FLAGS)
        _body(state, state.scene.mode.legend, look)
        imgui.end()
    imgui.pop_style_var(2)


def covers_views(width: float, count: int) -> bool:
    """Whether it would lie on the buttons of so many viewpoints, in a picture so wide, design pixels."""
    return width < _WIDTH + 2 * _MARGIN + 16 + 84 * count + (80 if count < FEWEST else 118)


@dataclass
class _Told(Facts):
    """The facts in a state, each looked up when a legend asks for it."""

    state: State

    @property
    def phrases(self) -> list[tuple[str, Colour, bool]]:
        return [(p.text, p.colour, p.found is None or p.found) for p in self.state.asking.asked]

    @property
    def heat(self) -> tuple[str, float, float]:
        prompt = self.state.asking.active_prompt
        assert prompt is not None
        return prompt.text, *self.state.heat_colours.ends(prompt.lit_from)

    @property
    def depth_range(self) -> tuple[float, float]:
        return self.state.stats.depth_range

    @property
    def atom(self) -> str:
        return self.state.editing.atom_name(self.state.asking.atom)

    @property
    def largest_atoms(self) -> list[tuple[str, Colour]]:
        insight, named = self.state.asking.insight, self.state.editing.atom_name
        if insight is None:
            return []
        largest = sorted(range(len(insight.shares)), key=lambda k: -insight.shares[k])[:_ATOMS_NAMED]
        return [(named(k), insight.colours[k]) for k in largest]

    @property
    def worst(self) -> float:
        from ....gl.photos import WORST  # loads torch; the worker has by now

        return WORST

    @property
    def warnings(self) -> list[str]:
        info = self.state.scene.info
        return list(tray.sentences(info.warnings)[:2]) if info is not None else []


def _body(state: State, make: Callable[[Facts], Legend], look: Look) -> None:
    mode = state.scene.mode
    if not possible(mode, state.scene.info):
        widgets.muted("This scene has no data for it.")
        return
    if mode.answers and not state.asking.asked:
        widgets.muted("Type a phrase to see this.")
        return
    legend = make(_Told(state))
    if legend.title:
        _bar(legend.title, state.preferences.colormap, legend.numbers, look)
    for text, colour, muted in legend.patches:
        _swatch(colour, look)
        _fitted(text, theme.MUTED if muted else theme.TEXT)
    for sentence in legend.sentences:
        widgets.muted(sentence)


def _bar(title: str, colormap: str, numbers: tuple[str, ...], look: Look) -> None:
    """A colour-bar with numbers below it, evenly spread."""
    _fitted(title, theme.TEXT)
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


def _swatch(colour: tuple[float, float, float], look: Look) -> None:
    side, line = look.px(12), imgui.get_text_line_height()
    corner = imgui.get_cursor_screen_pos()
    top = corner.y + (line - side) / 2
    end = ImVec2(corner.x + side, top + side)
    fill = widgets.u32(widgets.rgba(colour))
    imgui.get_window_draw_list().add_rect_filled(ImVec2(corner.x, top), end, fill, look.px(3))
    imgui.dummy(ImVec2(side, line))
    imgui.same_line()


def _fitted(text: str, colour: ImVec4) -> None:
    imgui.text_colored(colour, widgets.shortened(text, imgui.get_content_region_avail().x))
