"""Small pieces that several panels share."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Generic, NamedTuple, TypeVar

from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.scene.edits import Combine

from . import theme
from .look import Look

PLAIN = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
NO_KEYS = imgui.WindowFlags_.no_nav  # for windows that Tab and the arrows pass by
_Value = TypeVar("_Value")
_FOLDER = 1.3  # of a frame's height: the icon is wider than high
_HIGH = 760.0  # design pixels of a window
_WIDEST = 26.0  # of a line of a tooltip, in sizes of the font
_NEW_SECONDS, _NEW_FRAMES = 0.5, 3
"""Of what has come in the place of something else: a double click takes no longer, however slow frames are; a
window that then rests draws no fewer."""


@contextmanager
def window(name: str, pos: ImVec2, size: ImVec2, flags: int = 0, scrolls: bool = False) -> Iterator[None]:
    """A fixed window without decoration; with a scroll bar when it `scrolls`."""
    plain = PLAIN & ~imgui.WindowFlags_.no_scrollbar if scrolls else PLAIN
    imgui.set_next_window_pos(pos)
    imgui.set_next_window_size(size)
    imgui.begin(name, None, plain | imgui.WindowFlags_.no_bring_to_front_on_focus | flags)
    try:
        yield
    finally:
        imgui.end()


@contextmanager
def floating(
    name: str, look: Look, padding: tuple[float, float] | None = None, flags: int = 0
) -> Iterator[None]:
    """A rounded window over the picture, in the ground of popups, that takes no keys as it comes. padding:
    design pixels; None: the style's."""
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    imgui.push_style_var(
        imgui.StyleVar_.window_padding, look.vec(*padding) if padding else imgui.get_style().window_padding
    )
    with colours(window_bg=imgui.get_style().color_(imgui.Col_.popup_bg)):
        imgui.begin(name, None, PLAIN | imgui.WindowFlags_.no_focus_on_appearing | flags)
        try:
            yield
        finally:
            imgui.end()
            imgui.pop_style_var(2)


def to_front() -> None:
    """The window that is being drawn comes before others; menus and dialogs stay before it."""
    if not imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        imgui.internal.bring_window_to_display_front(imgui.internal.get_current_window())


@contextmanager
def colours(**changes: ImVec4) -> Iterator[None]:
    """Style colours by their name in `imgui.Col_`, for a few widgets."""
    for name, colour in changes.items():
        imgui.push_style_color(getattr(imgui.Col_, name), colour)
    try:
        yield
    finally:
        imgui.pop_style_color(len(changes))


def heading(text: str) -> None:
    """A section's title."""
    imgui.push_font(None, theme.FONT_SIZE * theme.HEADING)
    imgui.text_colored(theme.TEXT, text)
    imgui.pop_font()


def muted(text: str) -> None:
    """Secondary text, wrapped."""
    with colours(text=theme.MUTED):
        imgui.text_wrapped(text)


def primary_button(label: str, size: ImVec2 | None = None) -> bool:
    """The one button a section is about."""
    accent = theme.ACCENT
    lighter = ImVec4(min(accent.x * 1.06, 1), accent.y * 1.08, accent.z * 1.3, 1)
    with colours(button=accent, button_hovered=lighter, button_active=accent, text=theme.ON_ACCENT):
        return imgui.button(label, size or ImVec2(0, 0))


def press(
    label: str,
    command: _Value,
    tip: str = "",
    size: ImVec2 | None = None,
    able: bool = True,
    on: bool = False,
    quiet: bool = False,
) -> list[_Value]:
    """A button's command, once it is pressed. able: else it is greyed. on: as the primary one. quiet: without
    a frame."""
    if not able:
        imgui.begin_disabled()
    if on or quiet:
        pressed = primary_button(label, size) if on else quiet_button(label)
    else:
        pressed = imgui.button(label, size or ImVec2(0, 0))
    if not able:
        imgui.end_disabled()
    tooltip(tip)
    return [command] if pressed else []


class Answer(NamedTuple, Generic[_Value]):
    """A button below a question. width: design pixels. able: else it is greyed."""

    label: str
    width: float
    command: _Value
    tip: str = ""
    able: bool = True


def answers(look: Look, *given: Answer[_Value], default: int = 0) -> list[_Value]:
    """The buttons below a question, side by side while the window has room; the command of the pressed one.
    default: the place of the one that Enter presses."""
    issued: list[_Value] = []
    for place, (label, width, command, tip, able) in enumerate(given):
        if place:
            beside(look.px(width))
        imgui.begin_disabled(not able)
        button = default_button if place == default else imgui.button
        if button(label, look.vec(width, 0)):
            issued.append(command)
        imgui.end_disabled()
        tooltip(tip)
    return issued


def default_button(label: str, size: ImVec2 | None = None, confirmed: bool = False) -> bool:
    """The primary button of a dialog, which Enter presses too, unless the keys are on another control.
    confirmed: Enter has ended what is typed in the field that the dialog is about."""
    pressed = primary_button(label, size)
    imgui.set_item_default_focus()
    context = imgui.get_current_context()
    if context.last_item_data.item_flags & imgui.ItemFlags_.disabled.value:
        return False
    elsewhere = context.io.nav_visible and context.nav_id != imgui.get_item_id()
    taken = elsewhere or context.active_id_previous_frame != 0 or imgui.is_any_item_active()
    return pressed or confirmed or (enters() and not taken)


def confirmed() -> bool:
    """Whether Enter has ended what is typed in the last item, a field."""
    return imgui.is_item_deactivated() and enters()


def enters() -> bool:
    """Whether Enter, of the letters or of the numbers, went down in this frame."""
    return any(imgui.is_key_pressed(key, False) for key in (imgui.Key.enter, imgui.Key.keypad_enter))


def choice(options: Sequence[tuple[str, _Value]], chosen: _Value) -> _Value:
    """One of several values, a button each in a row, or in more where the window ends; returns the one that
    now holds."""
    imgui.begin_group()
    for index, (label, value) in enumerate(options):
        if index:
            beside(button_width(label), 0.5 * imgui.get_style().item_spacing.x)
        pressed = press(label, value, on=value == chosen)
        chosen = pressed[0] if pressed else chosen
    imgui.end_group()
    return chosen


def checkbox(label: str, on: bool) -> tuple[bool, bool]:
    """A box with an edge, so that it is seen while empty."""
    imgui.push_style_var(imgui.StyleVar_.frame_border_size, 1.0)
    with colours(border=theme.PRESSED):
        changed = imgui.checkbox(label, on)
    imgui.pop_style_var()
    return changed


def worded_checkbox(words: str, on: bool) -> tuple[bool, bool]:
    """The same in a window of a fixed width: where that ends, the words go on below."""
    room = imgui.get_content_region_avail().x - imgui.get_frame_height()
    gap = imgui.get_style().item_inner_spacing.x
    if imgui.calc_text_size(words).x + gap <= room:
        return checkbox(words, on)
    changed, now = checkbox(f"##{words}", on)
    imgui.same_line(0, gap)
    imgui.align_text_to_frame_padding()
    imgui.text_wrapped(words)
    return (True, not on) if imgui.is_item_clicked() else (changed, now)


def button_width(label: str) -> float:
    """What a button of this label takes, pixels."""
    return imgui.calc_text_size(label, True).x + 2 * imgui.get_style().frame_padding.x


def go_on(width: float, right: float, gap: float = -1.0) -> None:
    """Put the next item, of this width, beside the last one, or below where it would end beyond `right`;
    pixels of the screen. gap: between both; negative: the style's."""
    between = gap if gap >= 0 else imgui.get_style().item_spacing.x
    if imgui.internal.get_current_window().dc.cursor_pos_prev_line.x + between + width <= right:
        imgui.same_line(0, gap)


def beside(width: float, gap: float = -1.0) -> None:
    """`go_on` as far as the present window reaches."""
    go_on(width, imgui.internal.get_current_window().work_rect.max.x, gap)


def quiet_button(label: str, tip: str = "") -> bool:
    """An icon without a frame; `tip` explains it on hover."""
    clear = ImVec4(0, 0, 0, 0)
    with colours(button=clear, text=theme.MUTED):
        pressed = imgui.button(label)
    tooltip(tip)
    return pressed


def takes_clicks(name: str) -> bool:
    """Whether the items just drawn under this name take the click that ends now: not where it began as they
    had only just come, since it may be the second of a double click on what was in their place."""
    storage, frame, now = imgui.get_state_storage(), imgui.get_frame_count(), imgui.get_time()
    drawn, first, since, early = (
        imgui.get_id(f"{what} of {name}") for what in ("drawn", "first", "since", "early")
    )
    if storage.get_int(drawn, -2) < frame - 1:
        storage.set_int(first, frame)
        storage.set_float(since, now)
    storage.set_int(drawn, frame)
    if imgui.is_mouse_clicked(0):
        new = now - storage.get_float(since) < _NEW_SECONDS or frame - storage.get_int(first) < _NEW_FRAMES
        storage.set_bool(early, new)
    return not (storage.get_bool(early) and imgui.is_mouse_released(0))


def section(label: str, opened: bool = True) -> bool:
    """A quiet line that shows or hides what follows; whether it is shown."""
    shape = imgui.TreeNodeFlags_.no_tree_push_on_open | imgui.TreeNodeFlags_.span_avail_width
    begins = imgui.TreeNodeFlags_.default_open if opened else imgui.TreeNodeFlags_.none
    with colours(text=theme.MUTED):
        return imgui.tree_node_ex(label, shape | begins)


def column(x: float) -> None:
    """Go on in the same line at `x` of the window, as the cursor counts it."""
    imgui.same_line()
    imgui.set_cursor_pos_x(x)


def folder_room() -> float:
    """What `folder_button` takes beside a field, pixels."""
    return _FOLDER * imgui.get_frame_height() + imgui.get_style().item_spacing.x


def folder_button() -> bool:
    """Beside the field of a path to write to: whether another folder is wanted."""
    imgui.same_line()
    pressed = imgui.button(f"{fa.ICON_FA_FOLDER_OPEN}##folder", ImVec2(_FOLDER * imgui.get_frame_height(), 0))
    tooltip("Choose the folder")
    return pressed


def slider(
    label: str, value: float, limits: tuple[float, float], text: str, tip: str, width: float
) -> tuple[bool, float]:
    """A slider between its name, of the label what is before ##, and its value, where the knob cannot cover
    it; `width` of slider and value, to which `named` adds the name's."""
    name = label.partition("##")[0]
    if name:
        imgui.align_text_to_frame_padding()
        imgui.text_colored(theme.MUTED, name)
        tooltip(tip)
        imgui.same_line(0, imgui.get_style().item_inner_spacing.x)
    room = imgui.calc_text_size("0.00").x + imgui.get_style().item_inner_spacing.x
    imgui.set_next_item_width(width - room)
    flags = imgui.SliderFlags_.always_clamp
    changed, moved = imgui.slider_float(label.removeprefix(name), value, *limits, "", flags)
    tooltip(tip)
    imgui.same_line(0, imgui.get_style().item_inner_spacing.x)
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, text)
    return changed, moved


def named(label: str, width: float) -> float:
    """Pixels of a `slider` of this width with its name."""
    name = imgui.calc_text_size(label.partition("##")[0]).x
    return width + name + imgui.get_style().item_inner_spacing.x


def tooltip(text: str) -> None:
    """Explain the last item when the pointer rests on it; without words there is nothing."""
    if text and imgui.is_item_hovered(
        imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled
    ):
        imgui.set_tooltip(text)


def above_buttons(margin: float, least: float) -> float:
    """How high the part of a dialog from here on may be, for a row of buttons to be seen below it; pixels.
    margin: between the highest dialog and the window's edges, both together."""
    style, place = imgui.get_style(), imgui.get_cursor_pos_y()
    below = imgui.get_frame_height() + style.item_spacing.y + style.window_padding.y
    return max(imgui.get_io().display_size.y - margin - place - below, least)


def whole(text: str, tip: str) -> None:
    """Explain the last item, a field; all that stands in it where that is too long for it to show."""
    padding = imgui.get_style().frame_padding.x
    if imgui.calc_text_size(text).x <= imgui.get_item_rect_size().x - 2 * padding:
        tooltip(tip)
    elif imgui.begin_item_tooltip():
        imgui.push_text_wrap_pos(_WIDEST * imgui.get_font_size())
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def high(look: Look) -> bool:
    """Whether the window is so high that hints and warnings leave room for answers."""
    return imgui.get_io().display_size.y >= look.px(_HIGH)


def shortened(text: str, width: float) -> str:
    """The text, cut with an ellipsis where it is wider than `width` interface pixels."""
    if imgui.calc_text_size(text).x <= width:
        return text
    fits, wide = 1, len(text)  # letters that are kept at the least, and that are too many
    while wide - fits > 1:
        middle = (fits + wide) // 2
        if imgui.calc_text_size(text[:middle].rstrip() + "...").x > width:
            wide = middle
        else:
            fits = middle
    return text[:fits].rstrip() + "..."


def sentence(text: str) -> str:
    """`text` with a full stop and a capital, unless it begins with the name of a file."""
    named = any(mark in text.partition(" ")[0].rstrip(".") for mark in "./\\")
    return (text if named else text[:1].upper() + text[1:]).rstrip(".") + "."


def middle(aspect: float, target: float) -> tuple[ImVec2, ImVec2]:
    """Texture corners that fill a card of aspect `target` with the middle of a picture."""
    if aspect > target:
        margin = (1 - target / aspect) / 2
        return ImVec2(margin, 0), ImVec2(1 - margin, 1)
    margin = (1 - aspect / target) / 2
    return ImVec2(0, margin), ImVec2(1, 1 - margin)


def rgba(colour: tuple[float, float, float], alpha: float = 1.0) -> ImVec4:
    """An ImGui colour of an RGB triple."""
    return ImVec4(*colour, alpha)


def u32(colour: ImVec4) -> int:
    """A draw-list colour."""
    return imgui.color_convert_float4_to_u32(colour)


def centred(text: str, middle: ImVec2, colour: ImVec4) -> None:
    """Draw a text around a point of the screen."""
    extent = imgui.calc_text_size(text)
    at = ImVec2(middle.x - extent.x / 2, middle.y - extent.y / 2)
    imgui.get_window_draw_list().add_text(at, u32(colour), text)


def caption(text: str, corner: ImVec2, look: Look, shade: int = 190) -> None:
    """Draw words on a dark ground, whose upper left corner is given. shade: of the ground, up to 255."""
    canvas, extent = imgui.get_window_draw_list(), imgui.calc_text_size(text)
    end = ImVec2(corner.x + extent.x + look.px(14), corner.y + extent.y + look.px(6))
    canvas.add_rect_filled(corner, end, imgui.IM_COL32(14, 16, 20, shade), look.px(5))
    at = ImVec2(corner.x + look.px(7), corner.y + look.px(3))
    canvas.add_text(at, u32(theme.DARK.TEXT), text)


def gap(height: float) -> None:
    """Vertical space, interface pixels."""
    imgui.dummy(ImVec2(0, height))


def at_right_edge(text: str) -> None:
    """Text on the last item's line, flush right."""
    edge = imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x
    imgui.same_line(edge - imgui.calc_text_size(text).x)
    imgui.text(text)


def combined(usual: Combine) -> Combine:
    """What a selection does with the keys that are held now."""
    io = imgui.get_io()
    return "add" if io.key_shift else "remove" if io.key_ctrl else usual


def pointer(corner: ImVec2) -> tuple[float, float]:
    """Where the pointer is in the place that begins at `corner`, framebuffer pixels."""
    at, pixels = imgui.get_mouse_pos(), imgui.get_io().display_framebuffer_scale
    return (at.x - corner.x) * pixels.x, (at.y - corner.y) * pixels.y
