"""Preferences, the log, and the offer to go on with a session that ended badly."""

from dataclasses import replace

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from app.window import commands as do
from app.window import desk_commands as desk
from app.window import preferences, theme
from app.window.panels import widgets
from app.window.panels.look import Look
from app.window.preferences import SPEEDS, THEMES
from app.window.state import State

_OFFER = 480.0  # design pixels
_LABELS = 190.0


def draw_settings(state: State, look: Look) -> list[do.Command]:
    """The preferences; each takes effect at once."""
    old = state.desk.preferences
    new = old
    _label("Theme", look)
    new = replace(new, theme=widgets.choice([(name.capitalize(), name) for name in THEMES], old.theme))
    _label("Size of the interface", look)
    sizes = [(f"{scale:.0%}", scale) for scale in (0.75, 1.0, 1.25, 1.5, 2.0)]
    new = replace(new, scale=widgets.choice(sizes, old.scale))
    _label("Speed of flying", look)
    width = imgui.get_content_region_avail().x
    changed, speed = widgets.slider("##speed", old.speed, SPEEDS, f"{old.speed:.1f}", "", width)
    if changed:
        new = replace(new, speed=speed)
    for text, name in (
        ("Touch pad: two fingers turn, with Ctrl they zoom, with Shift they slide", "touch_pad"),
        ("Show the photos' cameras in the scene", "photos_in_space"),
        ("Reconstruct as soon as photos are dropped", "start_at_once"),
    ):
        changed, value = widgets.checkbox(text, getattr(old, name))
        if changed:
            new = replace(new, **{name: value})
    widgets.gap(look.px(4))
    widgets.muted(f"Kept in {preferences.file()}")
    issued: list[do.Command] = [] if new == old else [desk.Prefer(new)]
    if imgui.button(f"{fa.ICON_FA_ROTATE_LEFT}  Defaults"):
        kept = replace(preferences.DEFAULTS, recent=old.recent, window=old.window)
        issued.append(desk.Prefer(kept))
    return issued


def _label(text: str, look: Look) -> None:
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    imgui.same_line(look.px(_LABELS))


def draw_log(state: State, look: Look) -> list[do.Command]:
    """What has been said so far, oldest first."""
    imgui.begin_child("##lines", ImVec2(0, look.px(320)))
    for line in state.desk.lines:
        minutes, seconds = divmod(int(line.when), 60)
        imgui.text_colored(theme.MUTED, f"{minutes:3d}:{seconds:02d}")
        imgui.same_line()
        with widgets.colours(text=theme.BAD if line.kind == "error" else theme.TEXT):
            imgui.push_text_wrap_pos(0.0)
            imgui.text_unformatted(line.text)
            imgui.pop_text_wrap_pos()
    if not state.desk.lines:
        widgets.muted("Nothing has been said yet.")
    if imgui.is_window_appearing():
        imgui.set_scroll_here_y(1.0)
    imgui.end_child()
    if imgui.button(f"{fa.ICON_FA_COPY}  Copy all"):
        return [do.CopyText("\n".join(f"{line.when:.1f} s  {line.text}" for line in state.desk.lines))]
    return []


def draw_offer(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """A session that ended badly, offered without standing in the way."""
    kept = state.desk.offer
    if kept is None or state.job is not None or state.info is not None:
        return []
    issued: list[do.Command] = []
    middle = ImVec2(place.x + size.x / 2, place.y + look.px(16))
    imgui.set_next_window_pos(middle, 0, ImVec2(0.5, 0))
    imgui.set_next_window_size(ImVec2(min(look.px(_OFFER), size.x - look.px(24)), 0))
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    imgui.push_style_color(imgui.Col_.window_bg, theme.POPUP)
    imgui.begin("##session", None, widgets.PLAIN | imgui.WindowFlags_.no_focus_on_appearing)
    imgui.text_wrapped("LangFlash did not end well last time. It had open:")
    widgets.muted(kept.sentence())
    widgets.gap(look.px(2))
    if widgets.primary_button("Go on with it", look.vec(140, 0)):
        issued.append(desk.EndSessionOffer(restore=True))
    imgui.same_line()
    if imgui.button("Forget it", look.vec(120, 0)):
        issued.append(desk.EndSessionOffer(restore=False))
    imgui.end()
    imgui.pop_style_color()
    imgui.pop_style_var()
    return issued
