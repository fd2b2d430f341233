"""What a reconstruction cost, in the stages of the paper's table, and what its detail was spent on."""

from collections.abc import Mapping, Sequence

from imgui_bundle import imgui

from langflash_core.scene.report import detail_line

from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State

# The paper's rows, from this program's own stages. Depth, poses and their refinement take the place
# of the paper's point maps, which its Gaussian decoder predicts.
ROWS = (
    ("Language features", ("language features",)),
    ("Encoder", ("encoder",)),
    ("Grouping", ("grouping",)),
    ("Aggregation", ("aggregation",)),
    ("Gaussian decoder", ("depth", "poses", "refinement", "Gaussians")),
    ("Reading and tidying up", ("photos", "weights", "assembly", "pruning")),
)


def table(timings: Mapping[str, float]) -> list[tuple[str, float]]:
    """(row, seconds) of a scene's stages, the last one "All"; empty where nobody knows."""
    if not timings:
        return []
    rows = [(name, sum(timings.get(part, 0.0) for part in parts)) for name, parts in ROWS]
    return [*rows, ("All", sum(timings.values()))]


def draw(state: State, look: Look) -> None:
    """Both, folded away until they are asked for."""
    if state.scene.info is None:
        return
    record = state.scene.info.scene.record
    rows, detail = table(record.cost.timings), detail_line(record.detail)
    if rows and _opened(f"Made in {rows[-1][1]:.1f} s###cost"):
        _costs(rows, record.cost.peak_memory_mb)
    if detail and _opened(f"Detail: {record.detail.get('level', 'its own')}###detail"):
        with widgets.colours(text=theme.MUTED):
            imgui.text_wrapped(detail.replace(" · ", "\n"))


def _opened(title: str) -> bool:
    shape = imgui.TreeNodeFlags_.no_tree_push_on_open | imgui.TreeNodeFlags_.span_avail_width
    with widgets.colours(text=theme.MUTED):
        return imgui.tree_node_ex(title, shape)


def _costs(rows: Sequence[tuple[str, float]], peak: int | None) -> None:
    figures = [(name, f"{1000 * seconds:,.0f} ms") for name, seconds in rows]
    figures += [("Peak memory", f"{peak:,} MB")] if peak else []
    for name, figure in figures:
        colour = theme.TEXT if name in ("All", "Peak memory") else theme.MUTED
        imgui.text_colored(colour, name)
        with widgets.colours(text=colour):
            widgets.at_right_edge(figure)
