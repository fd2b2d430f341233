"""Where every row of the panels is, as the program itself drew it: controls, and what is written.

Calls of ImGui are passed on unchanged, as in items.py; here words count too, and the window that they are in.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

from imgui_bundle import imgui

from app.window.kit.boxes import Box, overlap

LABELLED = ("button", "small_button", "selectable", "checkbox")  # words that have to fit into the item itself
_FIELDS = ("input_text", "input_text_with_hint", "slider_float", "progress_bar")
_WORDS = ("text", "text_colored", "text_wrapped", "text_unformatted", "text_disabled")
SLACK = 1.0  # pixels: ImGui puts items on whole ones


@dataclass(frozen=True)
class Row:
    """One item: what it is, its words, where it is, and the inside of the window that it is in."""

    kind: str
    words: str
    window: str
    box: Box
    inside: Box
    scrolls: bool  # down, so that what is below the inside can be reached

    def __str__(self) -> str:
        return f"{self.kind} {self.words!r} in {self.window} at {tuple(round(side) for side in self.box)}"


class Rows:
    """The rows of the frame being drawn. monkeypatch: of pytest, so that ImGui is itself again afterwards."""

    def __init__(self, monkeypatch) -> None:
        self._found: list[Row] = []
        self._frame = -1
        for kind in (*LABELLED, *_FIELDS, *_WORDS):
            monkeypatch.setattr(imgui, kind, self._noting(kind, getattr(imgui, kind)))

    def now(self) -> list[Row]:
        """Of the last frame, in drawing order; without tooltips, which come and go."""
        return [row for row in self._found if "##Tooltip" not in row.window]

    def _noting(self, kind: str, real: Callable) -> Callable:
        def item(*arguments, **named):
            given = real(*arguments, **named)
            frame = imgui.get_frame_count()
            if frame != self._frame:
                self._frame, self._found = frame, []
            self._found.append(_row(kind, next((each for each in arguments if isinstance(each, str)), "")))
            return given

        return item


def _row(kind: str, words: str) -> Row:
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    window = imgui.internal.get_current_window()
    inner = window.inner_rect
    gap = imgui.get_style().item_spacing
    x, y = (
        (gap.x / 2, gap.y / 2) if kind == "selectable" else (0.0, 0.0)
    )  # beyond its words, as ImGui draws it
    scrolls = not window.flags & imgui.WindowFlags_.no_scrollbar and window.scroll_max.y > 0
    box = (low.x + x, low.y + y, high.x - x, high.y - y)
    inside = (inner.min.x, inner.min.y, inner.max.x, inner.max.y)
    return Row(kind, words.partition("##")[0], window.name, box, inside, bool(scrolls))


def clipped(row: Row) -> bool:
    """Whether some of it is out of its window's sight, and no scrolling brings it there; or its words are
    wider than the control that they are on."""
    left, top, right, bottom = row.box
    aside = left < row.inside[0] - SLACK or right > row.inside[2] + SLACK
    below = not row.scrolls and (top < row.inside[1] - SLACK or bottom > row.inside[3] + SLACK)
    room = right - left - (imgui.get_frame_height() if row.kind == "checkbox" else 0.0)
    too_long = row.kind in LABELLED and imgui.calc_text_size(row.words).x > room + SLACK
    return aside or below or too_long


def collisions(rows: list[Row]) -> list[tuple[Row, Row]]:
    """Pairs of one window that lie on each other; of a line that can be chosen its words count alone."""
    worded = [row for row in rows if row.words]
    return [
        (one, other)
        for one, other in combinations(worded, 2)
        if one.window == other.window and overlap(_smaller(_taken(one)), _smaller(_taken(other)))
    ]


def _taken(row: Row) -> Box:
    left, top, right, bottom = row.box
    return (
        left,
        top,
        left + imgui.calc_text_size(row.words).x if row.kind == "selectable" else right,
        bottom,
    )


def _smaller(box: Box) -> Box:
    return (box[0] + SLACK, box[1] + SLACK, box[2] - SLACK, box[3] - SLACK)
