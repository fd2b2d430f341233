"""The reliability diagram of a calibration as a picture; needs matplotlib (extra `plots`)."""

import io

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from langflash_core.lab.evaluation.calibration import Asked, reliability, trade_off

_COLOURS = ("#2f6fb0", "#d97b16", "#3b8f4e", "#7a55b5")
_INK, _GRID = "#3a3a40", "#dcdce2"


def calibration_png(sets: dict[str, Asked], threshold: float) -> bytes:
    """Left: the share of phrases that were there against their score; right: precision and recall of every
    threshold. The chosen threshold is a line in both."""
    figure = Figure((9.0, 3.8), dpi=110, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    for colour, (name, asked) in zip(_COLOURS * len(sets), sets.items(), strict=False):
        rows = reliability(asked)
        label = f"{name}, {len(asked.scores):,} phrases"
        left.plot(
            [row["score"] for row in rows], [row["present"] for row in rows], "o-",
            color=colour, markersize=4, linewidth=1.4, label=label,
        )  # fmt: skip
        thresholds, precisions, recalls = zip(*trade_off(asked), strict=True)
        right.plot(thresholds, precisions, color=colour, linewidth=1.6, label=f"{name}: precision")
        right.plot(thresholds, recalls, color=colour, linewidth=1.6, linestyle=":", label=f"{name}: recall")
    _finish(left, "score of a phrase (relevancy)", "share that was there", threshold)
    _finish(right, "threshold", "precision, recall", threshold)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def _finish(axes: Axes, across: str, up: str, threshold: float) -> None:
    axes.axvline(threshold, color=_INK, linewidth=0.9, linestyle="--")
    axes.annotate(
        f" {threshold:.2f}", (threshold, 0.02), xycoords=("data", "axes fraction"), fontsize=8, color=_INK
    )
    axes.set_xlabel(across, color=_INK)
    axes.set_ylabel(up, color=_INK)
    axes.set_ylim(-0.02, 1.02)
    axes.grid(True, color=_GRID, linewidth=0.8)
    axes.tick_params(colors=_INK, labelsize=9)
    axes.legend(fontsize=8, frameon=False, labelcolor=_INK)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(_GRID)
