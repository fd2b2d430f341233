"""What more photos cost, as a picture: processor time and memory against their number; needs matplotlib
(extra `plots`)."""

import io
import math
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from langflash_core.lab.evaluation.sides import number

_INK, _GRID, _TIME, _MEMORY = "#3a3a40", "#dcdce2", "#2f6fb0", "#d97b16"


def walk_png(result: Mapping) -> bytes:
    """Left: processor seconds of a scene against its photos, beside the line through 0 and the fewest of more
    than eight photos, as time would grow with their number alone. Right, where it was measured: the most
    memory.

    Args:
        result: of `run_walks`, means by number of photos.
    """
    rows = result["by_photos"]
    photos = [int(name) for name in rows]
    seconds = [number(row.get("cpu_seconds")) for row in rows.values()]
    memory = [number(row.get("memory_mb")) / 1000 for row in rows.values()]
    panels = 1 if all(map(math.isnan, memory)) else 2
    figure = Figure((4.5 * panels, 3.6), dpi=110, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    left, *right = figure.subplots(1, panels, squeeze=False)[0]
    start = next((k for k, count in enumerate(photos) if count > 8), 0)
    pace = seconds[start] / photos[start]
    left.plot([0, photos[-1]], [0, pace * photos[-1]], "--", color=_GRID, linewidth=1.4)
    _drawn(left, photos, seconds, _TIME, "processor seconds")
    for axes in right:
        _drawn(axes, photos, memory, _MEMORY, "memory, GB")
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def _drawn(axes: Axes, photos: Sequence[int], values: Sequence[float], colour: str, title: str) -> None:
    known = [(x, y) for x, y in zip(photos, values, strict=True) if not math.isnan(y)]
    if known:
        axes.plot(*zip(*known, strict=True), "o-", color=colour, markersize=4, linewidth=1.6)
    axes.set_xlabel("photos", color=_INK)
    axes.set_ylabel(title, color=_INK)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.grid(True, color=_GRID, linewidth=0.8)
    axes.tick_params(colors=_INK, labelsize=9)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(_GRID)
