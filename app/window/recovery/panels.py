"""Preferences, and the offers to go on with what an earlier session left."""

from dataclasses import replace

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.base.detail import DETAILS
from langflash_core.base.formats import COLOUR_MAPS

from .. import commands as do
from ..kit import boxes, theme, widgets
from ..kit.boxes import Box
from ..kit.look import Look
from ..state import State
from . import commands as keep
from . import preferences
from .preferences import RASTERISERS, SPEEDS, THEMES

_LABELS = 190.0  # design pixels
_EDITS_OFFER, _ANSWER, _NAME = 470.0, 108.0, 180.0  # design pixels wide; its buttons; a scene's name
_OFFER = 480.0  # design pixels
_SIZES = (0.75, 1.0, 1.25, 1.5, 2.0)  # of the interface
_OF_TOOLS = ("##card", "##ruler", "##keys", "Rules")  # windows, beside their bars
_DETAIL_TIP = (
    "How fine the next scene will be\nnormal: about 240,000 Gaussians from two photos\n"
    "high: 1.6 times as many, slower to draw\nlow: a third, quicker to draw"
)
_DRAWING_TIP = (
    "How Gaussians are drawn; pictures look the same\nmeasured: the quicker way on this graphics card\n"
    "quads: works everywhere\ntiles: needs OpenGL 4.3"
)


def draw_settings(state: State, look: Look) -> list[do.Command]:
    """The preferences; each takes effect at once."""
    new = old = state.preferences
    for label, name, options, tip in (
        ("Theme", "theme", [(name.capitalize(), name) for name in THEMES], ""),
        ("Colour map", "colormap", [(name, name) for name in COLOUR_MAPS], ""),
        ("Detail of new scenes", "detail", [(name.capitalize(), name) for name in DETAILS], _DETAIL_TIP),
        ("Drawing", "rasteriser", [(name.capitalize(), name) for name in RASTERISERS], _DRAWING_TIP),
        ("Interface size", "scale", [(f"{scale:.0%}", scale) for scale in _SIZES], ""),
    ):
        _label(label, look)
        new = replace(new, **{name: widgets.choice(options, getattr(old, name))})
        widgets.tooltip(tip)
    _label("Flying speed", look)
    width = imgui.get_content_region_avail().x
    changed, speed = widgets.slider("##speed", old.speed, SPEEDS, f"{old.speed:.1f}", "", width)
    if changed:
        new = replace(new, speed=speed)
    for text, name in (
        ("Touchpad: two fingers orbit; with Ctrl they zoom, with Shift they pan", "touch_pad"),
        ("Show the photos' cameras in the scene", "photos_in_space"),
        ("Stay near the photos: moves slow down, and the rest fades", "near_photos"),
        ("Show a grid on the floor, once the scene is level", "floor_grid"),
        ("Fill gaps from what is around them", "fill_gaps"),
        ("Reconstruct as soon as photos are dropped", "start_at_once"),
    ):
        changed, value = widgets.worded_checkbox(text, getattr(old, name))
        if changed:
            new = replace(new, **{name: value})
    widgets.gap(look.px(4))
    widgets.muted(f"Saved in {preferences.file()}")
    issued: list[do.Command] = [] if new == old else [keep.Prefer(new)]
    if imgui.button(f"{fa.ICON_FA_ROTATE_LEFT}  Defaults"):
        kept = replace(preferences.DEFAULTS, recent=old.recent, window=old.window)
        issued.append(keep.Prefer(kept))
    return issued


def _label(text: str, look: Look) -> None:
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    imgui.same_line(look.px(_LABELS))


def draw_offer(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """A session that ended badly, offered without standing in the way."""
    kept = state.recovery.session
    if kept is None or state.scene.job is not None or state.scene.info is not None:
        return []
    issued: list[do.Command] = []
    middle = ImVec2(place.x + size.x / 2, place.y + look.px(16))
    imgui.set_next_window_pos(middle, 0, ImVec2(0.5, 0))
    imgui.set_next_window_size(ImVec2(min(look.px(_OFFER), size.x - look.px(24)), 0))
    with widgets.floating("##session", look):
        imgui.text_wrapped("LangFlash did not close properly last time. It had open:")
        widgets.muted(kept.sentence())
        widgets.gap(look.px(2))
        if widgets.primary_button("Restore", look.vec(140, 0)):
            issued.append(keep.EndSessionOffer(restore=True))
        imgui.same_line()
        if imgui.button("Discard", look.vec(120, 0)):
            issued.append(keep.EndSessionOffer(restore=False))
    return issued


def draw_edits_offer(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """Edits that nobody saved, offered before what panels are there; it waits while what a tool in hand needs
    stands where it would."""
    offer = state.recovery.edits
    if offer is None or state.scene.job is not None:
        return []
    issued: list[do.Command] = []
    box, pivot = _stands(state, look, place, size)
    if _in_hand(box):
        return []
    middle = (box[0] + box[2]) / 2
    imgui.set_next_window_pos(ImVec2(middle, box[3] if pivot else box[1]), 0, ImVec2(0.5, pivot))
    imgui.set_next_window_size(ImVec2(box[2] - box[0], 0))
    with widgets.floating("##offer", look):
        widgets.to_front()
        edits, were = ("1 edit", "was") if offer.count == 1 else (f"{offer.count} edits", "were")
        imgui.text_colored(theme.ACCENT, fa.ICON_FA_CLOCK_ROTATE_LEFT)
        imgui.same_line()
        name = widgets.shortened(offer.name, look.px(_NAME))
        imgui.text_wrapped(f"{edits} of {name} {were} not saved ({offer.when:%d %B, %H:%M}).")
        if widgets.primary_button("Restore", look.vec(_ANSWER, 0)):
            issued.append(keep.EndOffer(restore=True))
        widgets.beside(look.px(_ANSWER))
        if imgui.button("Later", look.vec(_ANSWER, 0)):
            issued.append(keep.EndOffer())
        widgets.tooltip("You will be asked again next time")
        widgets.beside(look.px(_ANSWER))
        if imgui.button("Forget them", look.vec(_ANSWER, 0)):
            issued.append(keep.EndOffer(forget=True))
    return issued


def _stands(state: State, look: Look, place: ImVec2, size: ImVec2) -> tuple[Box, float]:
    """Where kept edits are offered, as high as they last were: at the foot of a place, beside the tools; in
    the empty window, whose tiles are there, at its head. The second value: its edge that stays, 0 or 1."""
    strip, margin = boxes.window_box("##tools"), look.px(12)
    own = imgui.internal.find_window_by_name("##offer")
    height = 0.0 if own is None else own.size.y
    left = (place.x if strip is None else strip[2]) + margin
    room = place.x + size.x - margin - left
    width = min(look.px(_EDITS_OFFER), room)
    if state.scene.info is None:
        left, top = left + (room - width) / 2, place.y + look.px(16)
        return (left, top, left + width, top + height), 0.0
    foot = place.y + size.y - look.px(14)
    return (left, foot - height, left + width, foot), 1.0


def _in_hand(box: Box) -> bool:
    """Whether what belongs to a tool in hand stands there."""
    found = [*boxes.bars(), *map(boxes.window_box, _OF_TOOLS)]
    return any(boxes.overlap(box, other) for other in found if other is not None)
