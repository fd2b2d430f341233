"""What the picture shows: the usual modes as buttons, all of them in a menu."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import camera
from ..state import Mode

USUAL = (Mode.RGB, Mode.HEAT, Mode.LABELS, Mode.ATOMS, Mode.DEPTH)
KEYED = tuple(Mode)[:10]  # on the keys 1 to 9 and 0
GROUPS = (
    ("Picture", (Mode.RGB, Mode.DEPTH, Mode.TRANSMITTANCE)),
    ("Answers", (Mode.HEAT, Mode.LABELS, Mode.MASKS, Mode.ISOLATE, Mode.HIDE, Mode.DIM)),
    ("Dictionary", (Mode.ATOMS, Mode.WEIGHT, Mode.FEATURES)),
    ("Trust", (Mode.COVERAGE, Mode.AGREEMENT, Mode.MARGIN)),
)
TIPS = {
    Mode.RGB: "Colour",
    Mode.HEAT: "Where the active phrase fits, over the colours",
    Mode.LABELS: "Every phrase in its own colour",
    Mode.ATOMS: "The groups the scene is made of",
    Mode.DEPTH: "Distance, near to far",
    Mode.MASKS: "What passes its threshold, as flat colours",
    Mode.ISOLATE: "Only what passes",
    Mode.HIDE: "Everything but what passes",
    Mode.DIM: "What passes in full colour, the rest dimmed",
    Mode.FEATURES: "Principal axes of the language features",
    Mode.WEIGHT: "How much of one group each pixel carries",
    Mode.TRANSMITTANCE: "The light that passes every splat",
    Mode.COVERAGE: "How many photos saw what is shown",
    Mode.AGREEMENT: "How well the photos agree on depth, where more than one covers a surface",
    Mode.MARGIN: "How clear the answer is",
}
_RESTING = imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled
_MENU = 296.0  # design pixels wide


def draw(state: State, look: Look, room: float) -> list[do.Command]:
    """Buttons for as many of the usual modes as `room` (interface pixels) has, and the menu."""
    issued: list[do.Command] = []
    imgui.begin_disabled(state.info is None)
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(4, 0))
    shown = _fitting(look, room)
    for mode in shown:
        if _choice(mode.value, state.mode is mode):
            issued.append(camera.SetMode(mode))
        widgets.tooltip(f"{TIPS[mode]}{_key(mode)}")
        imgui.same_line()
    named = state.mode not in shown
    if _choice(f"{state.mode.value if named else 'More'}  {fa.ICON_FA_CARET_DOWN}###menu", named):
        imgui.open_popup("modes")
    corner = ImVec2(imgui.get_item_rect_min().x, imgui.get_item_rect_max().y + look.px(6))
    imgui.pop_style_var()
    imgui.end_disabled()
    imgui.set_next_window_pos(corner, imgui.Cond_.appearing)
    imgui.push_style_var(imgui.StyleVar_.window_padding, look.vec(12, 10))
    if imgui.begin_popup("modes"):
        issued += _menu(state, look)
        imgui.end_popup()
    imgui.pop_style_var()
    return issued


def _fitting(look: Look, room: float) -> tuple[Mode, ...]:
    padding = 2 * imgui.get_style().frame_padding.x + look.px(4)
    menu = imgui.calc_text_size(f"{Mode.TRANSMITTANCE.value}  {fa.ICON_FA_CARET_DOWN}").x + padding
    left = room - menu
    shown: list[Mode] = []
    for mode in USUAL:
        left -= imgui.calc_text_size(mode.value).x + padding
        if left < 0:
            break
        shown.append(mode)
    return tuple(shown)


def _menu(state: State, look: Look) -> list[do.Command]:
    """Every mode with what it means; what the scene has no data for is greyed."""
    issued: list[do.Command] = []
    for place, (title, group) in enumerate(GROUPS):
        if place:
            widgets.gap(look.px(2))
        imgui.text_colored(theme.MUTED, title)
        for mode in group:
            possible = mode.possible(state.info)
            imgui.begin_disabled(not possible)
            if imgui.selectable(f"##{mode.name}", False, 0, ImVec2(look.px(_MENU - 24), 0))[0]:
                issued.append(camera.SetMode(mode))
            hovered = imgui.is_item_hovered(_RESTING)
            if state.mode is mode:
                imgui.same_line(look.px(12))
                imgui.text(fa.ICON_FA_CHECK)
            imgui.same_line(look.px(36))
            imgui.text(mode.value)
            imgui.end_disabled()
            if hovered:
                imgui.set_tooltip(TIPS[mode] if possible else _missing(mode))
            key = _key(mode).strip(" ()")
            imgui.same_line(look.px(_MENU) - look.px(14) - imgui.calc_text_size(key).x)
            imgui.text_colored(theme.MUTED, key)
    return issued


def _missing(mode: Mode) -> str:
    if mode is Mode.AGREEMENT:
        return "This scene does not say which photo made what, or has one photo only"
    return "This scene has no photos" if mode is Mode.COVERAGE else "This scene has no groups"


def _key(mode: Mode) -> str:
    return f"  ({(KEYED.index(mode) + 1) % 10})" if mode in KEYED else ""


def _choice(label: str, chosen: bool) -> bool:
    if chosen:
        return widgets.primary_button(label)
    return imgui.button(label)
