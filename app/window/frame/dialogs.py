"""The few dialogs."""

from collections.abc import Callable
from itertools import groupby
from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from .. import commands as do
from ..asking import commands as ask
from ..dialogs import Dialog
from ..editing import cleaning as clean
from ..exporting import commands as export
from ..exporting import panel as export_panel
from ..kit import theme, widgets
from ..kit.look import Look
from ..kit.widgets import Answer
from ..opening import commands as opening
from ..opening.panels import browser, strip
from ..recovery import panels as recovery_panels
from ..scene import commands as show
from ..scene import merging
from ..scene.drops import There, typed_path, typed_scene
from ..scene.panels import rooms
from ..state import State
from . import palette, table

_HELP, _HANDS, _KEYS = 940.0, 208.0, 170.0  # design pixels of the help, and of its keys
_MEASURED = 2  # frames until a dialog knows its height
_COLUMN = 350.0  # of a column of two, at the least
WIDTHS = {  # design pixels; others 520
    Dialog.EXPORT: export_panel.WIDTH,
    Dialog.SETTINGS: 560.0,
    Dialog.LOG: 640.0,
    Dialog.HELP: _HELP,
    Dialog.PALETTE: palette.WIDTH,
    Dialog.OPEN: browser.WIDTH,
    Dialog.MERGE: browser.WIDTH,
    Dialog.PLACE: browser.WIDTH,
    Dialog.FILM: strip.WIDTH,
}
GESTURES = (
    ("Left drag", "orbit; where a photo was taken, look around"),
    ("Alt + left drag", "orbit, there too"),
    ("Middle drag, Shift + left drag", "pan"),
    ("Wheel", "zoom"),
    ("Right drag", "look around"),
    ("W A S D, Q E", "fly; down, up; faster with Shift"),
    ("Shift, Ctrl while selecting", "add, subtract;  Alt: orbit"),
    ("Enter, Up, Down in a phrase", "next phrase, recent phrases"),
    ("Tab, F6", "next control, next area"),
    ("Esc", "one step back; cancels a job"),
)
_ARROWS = ("Left", "Right", "Up", "Down")
_POINTING = 6  # commands of a family whose keys point where they go
COLUMNS = ((None, "View", "Program"), ("File", "Find", "Tools", "Edit"))  # of help; None: the gestures
_CLOSING = (
    do.ShowDialog | show.SaveScene | show.OpenPaths | show.Instead | show.All | show.GoOn | show.SaveFirst
    | merging.MergeScene | merging.AddToScene | opening.LookForPlace | opening.PlaceFound | opening.TakeFrames
    | ask.SavePrompts | ask.LoadPrompts | clean.SaveRecipe | clean.LoadRecipe | export.Export
)  # fmt: skip


def draw(state: State, look: Look) -> list[do.Command]:
    """The dialog that is open, if any."""
    if state.dialog is None:
        if imgui.internal.get_top_most_popup_modal() is not None:  # Esc, or what it asked about is gone
            imgui.internal.close_popup_to_level(0, True)  # or keys go on in whatever stands on top
        return []
    title = state.dialog.value
    _place(state.dialog, look)
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    opened, kept = imgui.begin_popup_modal(title, True, imgui.WindowFlags_.no_resize)
    issued: list[do.Command] = []
    if opened:
        _keep_inside()
        if imgui.is_window_appearing():  # a part that scrolls is measured a frame later
            imgui.internal.get_current_window().hidden_frames_cannot_skip_items = _MEASURED
        issued = _body(state.dialog)(state, look)
        if not kept:
            issued.append(do.ShowDialog(None))
        if any(isinstance(c, _CLOSING) for c in issued):
            imgui.close_current_popup()
        imgui.end_popup()
    imgui.pop_style_var()
    return issued


def _place(dialog: Dialog, look: Look) -> None:
    """Open it in the middle, as wide as it wants and no higher than the window. One of many heights begins
    where the highest would."""
    if not imgui.is_popup_open(dialog.value):
        imgui.open_popup(dialog.value)
    middle = imgui.get_main_viewport().get_center()
    room, margin = imgui.get_io().display_size, look.px(24)
    if dialog is Dialog.EXPORT:
        top = max((room.y - look.px(export_panel.HEIGHT)) / 2, margin / 2)
        imgui.set_next_window_pos(ImVec2(middle.x, top), imgui.Cond_.appearing, ImVec2(0.5, 0))
    else:
        imgui.set_next_window_pos(middle, imgui.Cond_.appearing, ImVec2(0.5, 0.5))
    width = min(look.px(WIDTHS.get(dialog, 520.0)), room.x - margin)
    imgui.set_next_window_size_constraints(ImVec2(width, 0), ImVec2(width, room.y - margin))  # then scrolls
    imgui.set_next_window_size(ImVec2(width, 0))


def _keep_inside() -> None:
    """Move the dialog so that all of it is seen, after a drag or where the window became smaller."""
    place, size, room = imgui.get_window_pos(), imgui.get_window_size(), imgui.get_io().display_size
    inside = ImVec2(max(min(place.x, room.x - size.x), 0.0), max(min(place.y, room.y - size.y), 0.0))
    if (inside.x, inside.y) != (place.x, place.y):
        imgui.set_window_pos(inside)


def _body(dialog: Dialog) -> Callable[[State, Look], list[do.Command]]:
    """What draws the inside of a dialog."""
    return {
        Dialog.SAVE: _save,
        Dialog.OPEN: browser.draw,
        Dialog.HELP: _help,
        Dialog.LEAVE: _leave,
        Dialog.DROP: rooms.draw_drop,
        Dialog.DROP_SCENE: rooms.draw_scene_drop,
        Dialog.MERGE: browser.draw,
        Dialog.PLACE: browser.draw,
        Dialog.FILM: strip.draw,
        Dialog.UNSAVED: rooms.draw_unsaved,
        Dialog.SAVE_PROMPTS: _file("Save as", "Save", ask.SavePrompts),
        Dialog.LOAD_PROMPTS: _file(
            "A set of phrases (.prompts.json); it replaces the current ones", "Load", ask.LoadPrompts
        ),
        Dialog.SAVE_RECIPE: _file("Save as", "Save", clean.SaveRecipe),
        Dialog.LOAD_RECIPE: _file(
            "A recipe (.json); it replaces the current rules", "Load", clean.LoadRecipe
        ),
        Dialog.EXPORT: export_panel.draw,
        Dialog.REPLACE: export_panel.draw_replacing,
        Dialog.SETTINGS: recovery_panels.draw_settings,
        Dialog.LOG: _log,
        Dialog.PALETTE: palette.draw,
    }[dialog]


def _save(state: State, look: Look) -> list[do.Command]:
    issued, confirmed = _path_field(state, "Save as", place=True)
    path, exists = typed_scene(state.typed), state.typed.there is There.FILE
    consequence = f"{path} will be replaced." if exists else f"Saves {path}"
    widgets.muted("Type a file name." if path is None else consequence)
    imgui.begin_disabled(path is None)
    pressed = widgets.default_button("Replace" if exists else "Save", look.vec(120, 0), confirmed)
    imgui.end_disabled()
    issued += _cancel(look)
    if path is not None and pressed:
        issued.append(show.SaveScene(path))
    return issued


def _file(
    label: str, verb: str, make: Callable[[Path], do.Command]
) -> Callable[[State, Look], list[do.Command]]:
    """Asks for a path, with the button that does something with it."""

    def draw(state: State, look: Look) -> list[do.Command]:
        issued, confirmed = _path_field(state, label)
        text = state.typed.text.strip()
        imgui.begin_disabled(not text)
        replaces = verb == "Save" and state.typed.there is There.FILE
        pressed = widgets.default_button("Replace" if replaces else verb, look.vec(120, 0), confirmed)
        imgui.end_disabled()
        issued += _cancel(look)
        if text and pressed:
            issued.append(make(typed_path(text)))
        return issued

    return draw


def _cancel(look: Look) -> list[do.Command]:
    """Beside the button that does it."""
    imgui.same_line()
    return widgets.press("Cancel", do.ShowDialog(None), size=look.vec(110, 0))


def _path_field(state: State, label: str, place: bool = False) -> tuple[list[do.Command], bool]:
    """A path to edit, with a button for its folder if it is a `place` to write to; the second value tells
    whether Enter was pressed."""
    imgui.text_wrapped(label)
    imgui.set_next_item_width(-widgets.folder_room() if place else -1)
    if imgui.is_window_appearing():
        imgui.set_keyboard_focus_here()
    changed, path = imgui.input_text("##path", state.typed.text)
    confirmed = widgets.confirmed()
    issued: list[do.Command] = [do.EditDialogPath(path)] if changed else []
    if place and widgets.folder_button():
        issued.append(opening.LookForPlace())
    return issued, confirmed


def _help(state: State, look: Look) -> list[do.Command]:
    """Gestures and the keys of the table, by group; in two columns where there is room."""
    imgui.push_style_var(imgui.StyleVar_.item_spacing, look.vec(8, 3))
    left, room = imgui.get_cursor_pos_x(), imgui.get_content_region_avail().x
    two = room >= 2 * look.px(_COLUMN)
    for column, groups in enumerate(COLUMNS):
        if column and two:
            imgui.same_line(left + room / 2)
        imgui.begin_group()
        for group in groups:
            _help_group(group, look, room / 2 - look.px(8) if two else room)
        imgui.end_group()
    imgui.pop_style_var()
    _scroll_by_keys()
    return []


def _scroll_by_keys() -> None:
    """Where there is nothing that the keys could go to, ImGui scrolls nothing either."""
    most, moved = imgui.get_scroll_max_y(), 0.0
    for down, up, step in (
        (imgui.Key.down_arrow, imgui.Key.up_arrow, 3 * imgui.get_text_line_height()),
        (imgui.Key.page_down, imgui.Key.page_up, 0.9 * imgui.get_window_height()),
        (imgui.Key.end, imgui.Key.home, most),
    ):
        moved += step * (imgui.is_key_pressed(down) - imgui.is_key_pressed(up))
    if moved:
        imgui.set_scroll_y(min(max(imgui.get_scroll_y() + moved, 0.0), most))


def help_rows(group: str | None) -> list[tuple[str, str]]:
    """Keys and what they do; commands in a row that are called alike up to a colon share a row."""
    if group is None:
        return list(GESTURES)
    rows = []
    keyed = (entry for entry in table.ENTRIES if entry.group == group and entry.keys)
    for family, alike in groupby(keyed, lambda each: each.name.partition(": ")[0]):
        entries = list(alike)
        if len(entries) == 1:
            rows.append((", ".join(map(str, entries[0].keys)), entries[0].name))
        else:
            meaning = _meaning(family, [entry.name for entry in entries])
            kinds = zip(*(entry.keys for entry in entries), strict=True)
            rows += [(_together(keys), meaning) for keys in kinds]
    return rows


def _meaning(family: str, names: list[str]) -> str:
    """Of two commands both, of what keys point to the family alone, of many the ends."""
    ways = [name.removeprefix(f"{family}: ") for name in names]
    if len(ways) == 2:
        return f"{family}: {ways[0]}, {ways[1]}"
    return f"{family}: {ways[0]} to {ways[-1]}" if len(ways) > _POINTING else family


def _together(keys: tuple[table.Chord, ...]) -> str:
    """Keys in one breath: what is held once, four arrows as that, digits by their ends."""
    signs = [str(key) for key in keys]
    if all(sign.isdigit() for sign in signs):
        return f"{signs[0]} to {signs[-1]}"
    held = signs[0][: signs[0].rfind("+") + 1] if "+" in signs[0] else signs[0][: signs[0].find(" ") + 1]
    signs = [sign.removeprefix(held) for sign in signs]
    arrows = [*_ARROWS] == signs[: len(_ARROWS)]
    return held + ", ".join(["arrows", *signs[len(_ARROWS) :]] if arrows else signs)


def _help_group(group: str | None, look: Look, room: float) -> None:
    """`room` wide, pixels; what does not fit goes on below."""
    imgui.text_colored(theme.ACCENT, group or "Mouse")
    imgui.push_text_wrap_pos(imgui.get_cursor_pos_x() + room)
    for keys, meaning in help_rows(group):
        imgui.text(keys)
        taken = imgui.calc_text_size(keys).x + look.px(12)
        imgui.same_line(max(min(look.px(_KEYS if group else _HANDS), room / 2), taken))
        imgui.text_colored(theme.MUTED, meaning)
    imgui.pop_text_wrap_pos()
    widgets.gap(look.px(4))


def _leave(state: State, look: Look) -> list[do.Command]:
    info, export = state.scene.info, state.exporting.running
    stay, leave = do.ShowDialog(None), do.Leave(sure=True)
    if export is not None:
        imgui.text_wrapped(f"{export.target.name} is still being written; quitting drops it.")
    if export is not None and not do.unsaved(state):
        return widgets.answers(look, Answer("Wait for it", 140, stay), Answer("Quit without it", 180, leave))
    lost = "The scene is" if info is None or info.path is None else f"The edits of {info.name} are"
    imgui.text_wrapped(f"{lost} not saved.")
    return widgets.answers(
        look,
        Answer("Save and quit", 140, show.SaveFirst()),
        Answer("Quit without saving", 180, leave),
        Answer("Cancel", 110, stay),
    )


def _log(state: State, look: Look) -> list[do.Command]:
    """What has been said so far, oldest first."""
    imgui.begin_child("##lines", ImVec2(0, look.px(320)))
    for line in state.lines:
        minutes, seconds = divmod(int(line.when), 60)
        imgui.text_colored(theme.MUTED, f"{minutes:3d}:{seconds:02d}")
        imgui.same_line()
        with widgets.colours(text=theme.BAD if line.kind == "error" else theme.TEXT):
            imgui.push_text_wrap_pos(0.0)
            imgui.text_unformatted(line.text)
            imgui.pop_text_wrap_pos()
    if not state.lines:
        widgets.muted("No messages yet.")
    if imgui.is_window_appearing():
        imgui.set_scroll_here_y(1.0)
    imgui.end_child()
    if imgui.button(f"{fa.ICON_FA_COPY}  Copy all"):
        return [do.CopyText("\n".join(f"{line.when:.1f} s  {line.text}" for line in state.lines))]
    return []
