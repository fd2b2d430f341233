"""The study of a run as tables and plots: groupings by vectors, rivals by cost, K, and stages."""

from collections.abc import Mapping, Sequence
from typing import Any

from langflash_core.lab.evaluation.ablations.study import BYTES, CHANNELS, GROUPS, KEPT, RESIDUAL, Tally
from langflash_core.lab.evaluation.report_parts import Plot, Point
from langflash_core.lab.evaluation.speed import PAPER_MS
from langflash_core.lab.evaluation.tables import Table, cell, markdown, rounded
from langflash_core.lab.training.measures import accuracy, mean_iou, nan_mean

GROUPINGS = {
    "points": "points alone: k-means of place, normal, colour (stands for PointTransformer, untrained)",
    "sg": "semantic grouping (SG): the network's",
    "true": "true masks",
}
VECTORS = {
    "names": "true names",
    "average": "average of the features",
    "lfa": "aggregation and naming (LFA)",
}
RIVALS = {
    "features": ("2D features of the new view's own photo, no 3D", "features"),
    "splatted": ("features splatted, all channels", "splatted"),
    **{f"low_{d}": (f"{d} channels splatted, decoded per pixel (LSM's way)", f"low_{d}") for d in CHANNELS},
    "sg/average": ("atoms, averaged", "atoms"),
    "sg/lfa": ("atoms, LFA: what scenes hold", "atoms"),
    "residual": (f"atoms, LFA, and {RESIDUAL} residual channels", "residual"),
    "true/lfa": ("true masks, LFA", "true"),
    "points/lfa": ("groups of points, LFA", "points"),
}
"""Row: what it is, and whose time and bytes it has."""
SHORT = {
    "features": "2D features",
    "splatted": "all channels splatted",
    **{f"low_{d}": f"{d} channels, decoded" for d in CHANNELS},
    "sg/average": "atoms, averaged",
    "sg/lfa": "atoms, LFA",
    "residual": "atoms and residual",
    "true/lfa": "true masks",
    "points/lfa": "groups of points",
}
"""The same rows, in plots."""
COLUMNS = ("groups_accuracy", "groups_miou", "paper_accuracy", "paper_miou")
HEADINGS = ("class groups: accuracy", "class groups: mIoU", "8 labels: accuracy", "8 labels: mIoU")
PAPER_K = {128: "0.7144, 0.8547"}
"""mIoU and accuracy of the paper's table of K, where they are known to us; ScanNet, 40 scenes."""
STAGE_OF = {
    "language features": ("language features",),
    "shared encoder": ("encoder",),
    "grouping": ("grouping",),
    "aggregation": ("aggregation",),
    "Gaussian decoder": ("depth", "poses", "refinement", "Gaussians"),
}
"""The paper's stages, by ours."""


def summary(tally: Tally) -> dict[str, Any]:
    """Labels of the new view by row, and means of all numbers; plain JSON."""
    labels = {}
    for (row, kind), counts in tally.counts.items():
        own = labels.setdefault(row, {})
        own |= {f"{kind}_accuracy": accuracy(counts), f"{kind}_miou": mean_iou(counts)}
    measures = tally.means()
    base = tally.numbers.get("atoms_ms", [])
    for name, values in tally.numbers.items():
        if name.endswith("_ms") and base:  # room by room, so that a busy machine slows both
            ratios = [own / other for own, other in zip(values, base, strict=True)]
            measures[f"{name.removesuffix('_ms')}_times"] = nan_mean(ratios)
    return {
        "measures": rounded(measures),
        "labels": {row: rounded(own) for row, own in labels.items()},
    }


def ablation_tables(result: Mapping[str, Any]) -> list[Table]:
    """Groupings by vectors, rivals, K, stages."""
    return [_grid(result), _rivals(result), _groups(result), _stages(result["measures"])]


def ablation_plots(
    result: Mapping[str, Any], bounds: Mapping[str, Sequence[float] | None]
) -> tuple[Plot, ...]:
    """What a new view costs against what is called wrong in it: rivals, and numbers of groups."""
    measures = result["measures"]
    rivals = [
        _point(row, SHORT[row], measures.get(f"{cost}_ms"), result, bounds)
        for row, (_, cost) in RIVALS.items()
    ]
    studied = [_point(f"K{k}/lfa", f"K = {k}", measures.get(f"K{k}_ms"), result, bounds) for k in GROUPS]
    across, up = "seconds for a new view, one thread", "1 - mIoU over class groups"
    return (
        Plot("Speed against error: a new view named", across, up, [p for p in rivals if p]),
        Plot("Speed against error: numbers of groups", across, up, [p for p in studied if p]),
    )


def _point(
    row: str,
    name: str,
    milliseconds: float | None,
    result: Mapping[str, Any],
    bounds: Mapping[str, Sequence[float] | None],
) -> Point | None:
    value = result["labels"].get(row, {}).get("groups_miou")
    if value is None or milliseconds is None:
        return None
    around = bounds.get(f"labels/{row}/groups_miou")
    return Point(name, milliseconds / 1e3, 1 - value, around and [1 - around[1], 1 - around[0]])


def ablation_markdown(result: Mapping[str, Any]) -> str:
    """All tables."""
    return markdown(ablation_tables(result), f"{result['scenes']} rooms, weights {result['weights']}")


def _values(result: Mapping[str, Any], row: str) -> tuple[str, ...]:
    return tuple(cell(result["labels"].get(row, {}).get(column)) for column in COLUMNS)


def _grid(result: Mapping[str, Any]) -> Table:
    rows = [
        (grouped, vectors, *_values(result, f"{grouping}/{kind}"))
        for grouping, grouped in GROUPINGS.items()
        for kind, vectors in VECTORS.items()
        if f"{grouping}/{kind}" in result["labels"]
    ]
    return Table("Ablation: how groups are made, and what names them", ("groups", "vectors", *HEADINGS), rows)


def _rivals(result: Mapping[str, Any]) -> Table:
    measures = result["measures"]
    rows = []
    for row, (name, cost) in RIVALS.items():
        if row in result["labels"]:
            size = BYTES.get(cost, 0 if cost == "features" else BYTES["atoms"])
            rows.append(
                (
                    name,
                    str(size) if size else "-",
                    f"{measures[f'{cost}_ms']:,.0f}",
                    f"{measures[f'{cost}_times']:.2f}",
                    *_values(result, row),
                )
            )
    title = f"Rivals: a new view named, the same Gaussians and rasteriser ({KEPT} weights a Gaussian)"
    return Table(title, ("language by", "bytes a Gaussian", "ms", "x atoms", *HEADINGS), rows)


def _groups(result: Mapping[str, Any]) -> Table:
    measures = result["measures"]
    own = measures.get("atoms_count")
    rows = []
    if own is not None:
        title = f"as the network has them: {own:.0f}"
        rows.append(_group_row(title, "sg", "atoms", result))
    rows += [_group_row(str(k), f"K{k}", f"K{k}", result) for k in GROUPS if f"K{k}/lfa" in result["labels"]]
    title = "K: the network's groups merged or cut to so many, without training"
    return Table(
        title,
        ("K", "LFA ms", "ms a view", "x atoms", "LFA: 8 labels mIoU", "LFA: class groups mIoU",
         "average: 8 labels mIoU", "average: class groups mIoU", "paper: mIoU, accuracy"),
        rows,
    )  # fmt: skip


def _group_row(title: str, row: str, cost: str, result: Mapping[str, Any]) -> tuple[str, ...]:
    measures, labels = result["measures"], result["labels"]
    kinds = [
        cell(labels.get(f"{row}/{kind}", {}).get(f"{names}_miou"))
        for kind in ("lfa", "average")
        for names in ("paper", "groups")
    ]
    return (
        title,
        f"{1e3 * measures[f'{cost}_lfa_seconds']:,.0f}",
        f"{measures[f'{cost}_ms']:,.0f}",
        f"{measures[f'{cost}_times']:.2f}",
        *kinds,
        PAPER_K.get(int(title), "") if title.isdigit() else "",
    )


def _stages(measures: Mapping[str, float | None]) -> Table:
    rows = []
    for stage, parts in STAGE_OF.items():
        own = [measures.get(f"stage_{part}_seconds") for part in parts]
        known = [seconds for seconds in own if seconds is not None]
        if known:
            rows.append((stage, f"{1e3 * sum(known):,.0f}", f"{PAPER_MS[stage]:g}"))
    return Table(
        "Stages for two photos", ("stage", "ms here", "ms of the paper, unnamed GPU, another network"), rows
    )
