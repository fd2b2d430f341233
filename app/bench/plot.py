"""Speed against error as a picture: one point a mode, on the left of answers, on the right of colours.

Time is that of a frame over the default's of the same round, the median of which a busy machine moves
least; the milliseconds of the default stand beside it.
"""

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from .modes import MODES

_COLOURS = {
    "default": "#1b1b1f",
    "precision": "#2f6fb0",
    "relevance": "#c2378b",
    "weights": "#d97b16",
    "cut": "#3b8f4e",
    "dictionary": "#7a55b5",
    "resolution": "#c43d3d",
    "detail": "#8a6d3b",
    "sort": "#15878f",
    "rasteriser": "#6b7f1f",
    "language": "#4d7c8a",
}
_INK, _GRID = "#3a3a40", "#dcdce2"
_DPI = 100
_INCHES = (10.0, 4.2)  # one case
_SMALLEST_ERROR = 1e-8  # of relevance: float32 rounds coarser
_BEST_PSNR = 160.0  # dB: beyond it pictures are equal
_GAP = 2.0  # pixels round a label
_Point = tuple[str, str, float, float]  # mode, axis, time, error


def write_plot(document: dict, path: Path) -> None:
    """A PNG with a row of panels for each case of a bench document."""
    figure_of(document).savefig(path, format="png", metadata={"Software": None})


def figure_of(document: dict) -> Figure:
    """The same as a figure of matplotlib's, every label in its place."""
    cases = document["cases"]
    figure = Figure((_INCHES[0], _INCHES[1] * len(cases)), dpi=_DPI, layout="constrained", facecolor="white")
    canvas = FigureCanvasAgg(figure)
    panels = figure.subplots(len(cases), 2, squeeze=False)
    drawn = [_draw_case(row, case) for row, case in zip(panels, cases, strict=True)]
    figure.suptitle(document["machine"]["gpu"], fontsize=8, color=_INK, x=0.995, ha="right")
    canvas.draw()  # the layout is final and texts have sizes only now
    figure.set_layout_engine("none")
    for row, pair in zip(panels, drawn, strict=True):
        for axes, points in zip(row, pair, strict=True):
            _label(axes, points)
    return figure


def _draw_case(row: Sequence[Axes], case: dict) -> tuple[list[_Point], list[_Point]]:
    changes_colours = {mode.name for mode in MODES if mode.colours} | {"default"}
    answers, colours = [], []
    for each in case["rows"]:
        name, axis, time = each["mode"], each["axis"], each["times_default"]
        answers.append((name, axis, time, max(each["relevance_mean"], _SMALLEST_ERROR)))
        if name in changes_colours:
            psnr = _BEST_PSNR if each["psnr_db"] is None else each["psnr_db"]
            colours.append((name, axis, time, min(psnr, _BEST_PSNR)))
    default = case["rows"][0]["ms_median"]
    _scatter(row[0], answers, "mean error of relevance", f"{case['name']}: answers")
    row[0].set_yscale("log")
    _scatter(row[1], colours, "PSNR of colours, dB (worse is up)", "colours; lower left is better")
    row[1].invert_yaxis()
    for axes in row:
        axes.set_xlabel(f"time of a frame; the default's, 1, is {default:,.4g} ms", color=_INK)
        axes.margins(0.14, 0.16)
        _plain_ticks(axes)
    return answers, colours


def _scatter(axes: Axes, points: list[_Point], title: str, heading: str) -> None:
    axes.set_xscale("log")
    for _, axis, time, error in points:
        axes.plot(time, error, "o", markersize=7, color=_COLOURS[axis], markeredgecolor="white", zorder=3)
    axes.set_title(heading, fontsize=10, color=_INK, loc="left")
    axes.set_ylabel(title, color=_INK)
    axes.grid(True, color=_GRID, linewidth=0.8)
    axes.tick_params(colors=_INK, labelsize=9)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(_GRID)


def _plain_ticks(axes: Axes) -> None:
    """Round numbers instead of powers of ten."""
    low, high = axes.get_xlim()
    if high < 4 * low:
        ticks = [
            tick
            for tick in MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
            if low <= tick <= high
        ]
    else:
        decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        steps = (1, 2, 3, 5, 7) if high < 20 * low else (1, 2, 5)
        ticks = [step * 10.0**d for d in decades for step in steps if low <= step * 10.0**d <= high]
    axes.set_xticks(ticks, [f"{tick:,g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set_xlim(low, high)


def _label(axes: Axes, points: list[_Point]) -> None:
    """Names beside their points, where neither another name nor a point is; a line leads to those far off."""
    renderer = axes.figure.canvas.get_renderer()  # type: ignore[union-attr]
    inside = axes.get_window_extent(renderer)
    marks = [axes.transData.transform((time, error)) for _, _, time, error in points]
    taken = [Bbox.from_extents(x - 5, y - 5, x + 5, y + 5) for x, y in marks]
    for (name, axis, _, _), (x, y) in zip(points, marks, strict=True):
        text = axes.annotate(
            name, (x, y), xycoords="figure pixels", fontsize=9, color=_COLOURS[axis], va="center", zorder=4
        )
        size = text.get_window_extent(renderer)
        box = _free_box(x, y, size.width, size.height, taken, inside)
        text.set_position((box.x0, (box.y0 + box.y1) / 2))
        taken.append(box)
        end = (box.x0 if x < box.x0 else box.x1 if x > box.x1 else x), min(max(y, box.y0), box.y1)
        if math.dist(end, (x, y)) > 20:
            axes.annotate(
                "", end, (x, y), "figure pixels", "figure pixels",
                arrowprops={"arrowstyle": "-", "color": _COLOURS[axis], "linewidth": 0.7, "shrinkA": 5},
            )  # fmt: skip


def _free_box(x: float, y: float, width: float, height: float, taken: list[Bbox], inside: Bbox) -> Bbox:
    """Where a text of this size goes, figure pixels: the nearest place round the point that is free."""
    candidates = []
    for reach in range(8, 130, 4):
        for turn in range(16):
            across, up = math.cos(turn * math.pi / 8), math.sin(turn * math.pi / 8)
            left = x + reach * across - width * (1 - across) / 2
            middle = y + reach * up + height * up / 2
            box = Bbox.from_extents(left, middle - height / 2, left + width, middle + height / 2)
            candidates.append(box)
            wide = Bbox.from_extents(box.x0 - _GAP, box.y0 - _GAP, box.x1 + _GAP, box.y1 + _GAP)
            within = (
                box.x0 >= inside.x0 and box.x1 <= inside.x1 and box.y0 >= inside.y0 and box.y1 <= inside.y1
            )
            if within and not any(wide.overlaps(other) for other in taken):
                return box
    return candidates[0]
