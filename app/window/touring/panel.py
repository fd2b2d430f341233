"""The tour beside the picture: its stops in their order, its notes; and the notes at their points in the
picture."""

import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.geometry import poses
from langflash_core.scene.settings import TOURS
from langflash_core.scene.tour import Note, Stop

from .. import commands as do
from ..filming import commands as film
from ..kit import boxes, theme, widgets
from ..kit.lengths import said
from ..kit.look import Look
from ..state import State
from . import commands as tour

_SIZE = (330.0, 400.0)  # design pixels, the height at most
_BELOW = 150.0  # of the axes and the key frames, which are above
_BUTTON, _LEAST = 30.0, 120.0  # the second: of the height
_FAINT = 0.35  # how much is seen of a note that is behind a surface
_LETTERS = 40  # of a note that are shown in the picture


def button(state: State) -> list[do.Command]:
    """Opens the tour, or closes it."""
    label, on, there = f"{fa.ICON_FA_SIGNS_POST}##tour", state.touring.open, state.scene.info is not None
    tip = "Guided tour: named stops and notes, for films and web pages"
    issued: list[do.Command] = [*widgets.press(label, tour.ShowTour(not on), tip, able=there, on=on)]
    imgui.same_line()
    return issued


def draw(state: State, look: Look, place: ImVec2, size: ImVec2) -> list[do.Command]:
    """The window over the picture's right side, or over the panel where that is narrow."""
    if not state.touring.open:
        return []
    corner, extent = boxes.opens_at(place, size, size.y, look, _BELOW, _SIZE, _LEAST)
    imgui.set_next_window_pos(corner, imgui.Cond_.appearing)
    imgui.set_next_window_size(extent, imgui.Cond_.appearing)
    imgui.push_style_var(imgui.StyleVar_.window_rounding, look.px(8))
    flags = imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings
    issued: list[do.Command] = []
    shown, kept = imgui.begin("Tour", True, flags)
    if shown:
        issued += _bar(state, look)
        for number, stop in enumerate(state.tour.stops):
            issued += _stop(state, number, stop, look)
        if state.tour.notes:
            imgui.separator_text("Notes")
        for number, note in enumerate(state.tour.notes):
            issued += _note(state, number, note, look)
        widgets.muted("Notes are pinned with “What is this?” (X) or the ruler (T).")
    imgui.end()
    imgui.pop_style_var()
    return issued if kept else [*issued, tour.ShowTour(False)]


def _bar(state: State, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    wide, playing = ImVec2(look.px(_BUTTON), 0), state.filming.tour is not None
    there = bool(state.tour.stops)
    play, flight = (fa.ICON_FA_STOP, film.StopTour()) if playing else (fa.ICON_FA_PLAY, tour.Play())
    for icon, command, tip in (
        (fa.ICON_FA_BACKWARD_STEP, tour.Step(-1), "Previous stop  (PgUp)"),
        (play, flight, "Play the tour"),
        (fa.ICON_FA_FORWARD_STEP, tour.Step(1), "Next stop  (PgDn)"),
    ):
        issued += widgets.press(f"{icon}##{tip}", command, tip, wide, there)
        imgui.same_line(0, look.px(4))
    tip = "Add this view as the next stop, with the active phrase"
    issued += widgets.press(f"{fa.ICON_FA_PLUS}  Add this view", tour.AddStop(), tip, on=True)
    return issued


def _stop(state: State, number: int, stop: Stop, look: Look) -> list[do.Command]:
    """One line: go there, name, start, order, away."""
    issued: list[do.Command] = []
    imgui.push_id(f"stop {number}")
    wide, gap = ImVec2(look.px(_BUTTON), 0), look.px(4)
    here = number == state.touring.place
    tip = f'Fly there, and ask "{stop.phrase}"' if stop.phrase else "Fly there"
    issued += widgets.press(f"{number + 1}##go", tour.GoToStop(number), tip, wide, on=here)
    imgui.same_line(0, gap)
    imgui.set_next_item_width(imgui.get_content_region_avail().x - 4 * (look.px(_BUTTON) + gap))
    _, name = imgui.input_text("##name", stop.name)
    if imgui.is_item_deactivated_after_edit() and name != stop.name:
        name, told = _cut(name, TOURS.longest_name, "A stop's name")
        issued += [tour.ChangeStop(number, name=name), *told]
    widgets.whole(stop.name, "Its name")
    start, last = state.tour.start == stop.name, len(state.tour.stops) - 1
    for icon, tip, command, can in (
        (fa.ICON_FA_FLAG, "Web pages open at the first photo" if start else "Web pages open here",
         tour.StartAt("" if start else stop.name), True),
        (fa.ICON_FA_ARROW_UP, "Earlier", tour.MoveStop(number, number - 1), number > 0),
        (fa.ICON_FA_ARROW_DOWN, "Later", tour.MoveStop(number, number + 1), number < last),
        (fa.ICON_FA_TRASH, "Remove it", tour.RemoveStop(number), True),
    ):  # fmt: skip
        imgui.same_line(0, gap)
        marked = start and icon == fa.ICON_FA_FLAG
        issued += widgets.press(f"{icon}##{icon}", command, tip, wide, can, marked)
    if here:
        issued += _told(number, stop)
    imgui.pop_id()
    return issued


def _told(number: int, stop: Stop) -> list[do.Command]:
    """What is told at the stop where one is."""
    imgui.set_next_item_width(-1)
    _, text = imgui.input_text_with_hint("##text", "text shown here", stop.text)
    changed = imgui.is_item_deactivated_after_edit() and text != stop.text
    widgets.whole(stop.text, "")
    text, told = _cut(text, TOURS.longest_text, "The text shown at a stop")
    return [tour.ChangeStop(number, text=text), *told] if changed else []


def _cut(text: str, most: int, what: str) -> tuple[str, list[do.Command]]:
    """As much of what was typed as there is room for; refused, all of it would be lost."""
    told = do.Notify(f"{what} has at most {most} letters; the rest was left out.", "info")
    return text.strip()[:most], [told] if len(text.strip()) > most else []


def _note(state: State, number: int, note: Note, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    imgui.push_id(f"note {number}")
    wide, gap = ImVec2(look.px(_BUTTON), 0), look.px(4)
    icon = fa.ICON_FA_RULER if note.to else fa.ICON_FA_THUMBTACK
    tip = f'Ask "{note.phrase}"' if note.phrase else _measured(state, note) or "No phrase"
    issued += widgets.press(f"{icon}##ask", tour.AskNote(number), tip, wide, able=bool(note.phrase))
    imgui.same_line(0, gap)
    imgui.set_next_item_width(imgui.get_content_region_avail().x - look.px(_BUTTON) - gap)
    _, text = imgui.input_text("##text", note.text)
    if imgui.is_item_deactivated_after_edit() and text != note.text:
        text, told = _cut(text, TOURS.longest_text, "A note")
        issued += [tour.ChangeNote(number, text), *told]
    widgets.whole(note.text, "")
    imgui.same_line(0, gap)
    issued += widgets.press(f"{fa.ICON_FA_TRASH}##gone", tour.RemoveNote(number), "Remove it", wide)
    imgui.pop_id()
    return issued


def _measured(state: State, note: Note) -> str:
    """Its length as the ruler says it; "" of a note that measures none."""
    return "" if note.length is None else said(note.length, state.metric, state.guess)


def draw_notes(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """On the picture, in the present window: every note at its point; one behind a surface as a faint mark
    without words."""
    if not state.shows_notes:
        return
    canvas, accent = imgui.get_window_draw_list(), theme.DARK.ACCENT
    behind = state.touring.behind
    canvas.push_clip_rect(corner, ImVec2(corner.x + size.x, corner.y + size.y), True)
    for note in sorted(state.tour.notes, key=lambda each: each not in behind):
        colour = widgets.u32(ImVec4(accent.x, accent.y, accent.z, _FAINT if note in behind else 1.0))
        ends = [note.at] if note.to is None else [note.at, note.to]
        found = poses.project(np.array(ends), state.scene.pose, (size.x, size.y))
        if found is None:
            continue
        points = [ImVec2(corner.x + float(x), corner.y + float(y)) for x, y in found[1]]
        if len(points) == 2:
            canvas.add_line(points[0], points[1], colour, look.px(2))
        for point in points:
            canvas.add_circle_filled(point, look.px(4), colour)
        if note in behind:
            continue
        middle = ImVec2(sum(p.x for p in points) / len(points), sum(p.y for p in points) / len(points))
        text = note.text if len(note.text) <= _LETTERS else note.text[: _LETTERS - 1] + "…"
        text = " · ".join(filter(None, (text, _measured(state, note))))
        top = middle.y - imgui.calc_text_size(text).y / 2 - look.px(3)
        widgets.caption(text, ImVec2(middle.x + look.px(10), top), look, shade=205)
    canvas.pop_clip_rect()
