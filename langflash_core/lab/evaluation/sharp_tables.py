"""Results of `langflash lab eval sharp` as tables: columns beside each other, and paired differences."""

import math
from collections.abc import Iterator, Mapping, Sequence

from langflash_core.lab.evaluation.sharp import GRID, OTHER
from langflash_core.lab.evaluation.sides import number
from langflash_core.lab.training.measures import nan_mean

_SHARE, _COUNT = ".1%", ",.0f"
GROUPS = {
    "photos": (
        "The photos' own places, at the photo's size",
        (
            ("PSNR (dB)", "psnr", ".2f"),
            ("LPIPS", "lpips", ".3f"),
            ("detail, of the photo's", "detail", ".3f"),
            ("detail in its place, of the photo's", "true_detail", ".3f"),
            ("lattice on flat walls (1/255)", "lattice", ".2f"),
            ("opaque (% of pixels)", "opaque", _SHARE),
            ("light from behind (%)", "through", _SHARE),
            ("opaque at eight times that size (%)", "opaque_8x", _SHARE),
            ("ripple of flat walls there (1/255)", "ripple", ".2f"),
        ),
    ),
    "between": (
        "A kept photo from between, at its size",
        (
            ("PSNR (dB)", "psnr", ".2f"),
            ("LPIPS", "lpips", ".3f"),
            ("detail, of the photo's", "detail", ".3f"),
            ("detail in its place, of the photo's", "true_detail", ".3f"),
            ("opaque (% of pixels)", "opaque", _SHARE),
            ("light from behind (%)", "through", _SHARE),
            ("seen by a photo (%)", "seen", _SHARE),
        ),
    ),
    "between_small": (
        "A kept photo from between, at the network's size",
        (
            ("PSNR (dB)", "psnr", ".2f"),
            ("LPIPS", "lpips", ".3f"),
            ("detail, of the photo's", "detail", ".3f"),
            ("detail in its place, of the photo's", "true_detail", ".3f"),
            ("opaque (% of pixels)", "opaque", _SHARE),
            ("light from behind (%)", "through", _SHARE),
        ),
    ),
    "once": (
        "A scene",
        (
            ("Gaussians", "gaussians", _COUNT),
            ("bytes of its file", "bytes", _COUNT),
            ("seconds to make it", "seconds", ".2f"),
        ),
    ),
}
"""Title and measures (text, key, format) of each group. Means are taken of whatever groups a column has, say
"borders" of labelled photos; those that are listed here are shown."""
_TITLES = {GRID: "photo through the grid", OTHER: "other version"}


def sharp_markdown(result: dict) -> str:
    """The tables of a `run_sharp` result: means, and differences of the last way from every other column."""
    lines = []
    for group, (title, _) in GROUPS.items():
        header, rows = means_table(result["measures"], group)
        if rows:
            lines += [f"**{title}**", "", *_lines(header, rows), ""]
    header, rows = differences_table(result)
    if rows:
        lines += [f"**Differences over {len(result['cases'])}, mean ± standard error**", ""]
        lines += [*_lines(header, rows), ""]
    return "\n".join(lines).rstrip() + "\n"


def means_table(
    measures: Mapping[str, Mapping[str, Mapping]], group: str
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows of a group: a row a measure, a column a column; empty where nobody has it."""
    columns = [column for column in _ordered(measures) if group in measures[column]]
    rows = []
    for text, key, form in GROUPS[group][1]:
        values = [number(measures[column][group].get(key)) for column in columns]
        if not all(math.isnan(value) for value in values):
            rows.append((text, *(told(value, form) for value in values)))
    return ("measure", *(_TITLES.get(column, column) for column in columns)), rows


def differences_table(result: dict) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows: the last way minus each rival, case by case; a row a measure of a group."""
    judged = result["ways"][-1]
    rivals = [column for column in _ordered(result["measures"]) if column != judged]
    rows = []
    for group, (title, measures) in GROUPS.items():
        for text, key, form in measures:
            changes = [paired_difference(result["cases"], judged, rival, group, key) for rival in rivals]
            if any(count for _, _, count in changes):
                rows.append((f"{title}: {text}", *(_change(change, form) for change in changes)))
    return (f"{judged} minus", *(_TITLES.get(rival, rival) for rival in rivals)), rows


def paired_difference(
    cases: Sequence[Mapping], judged: str, rival: str, group: str, key: str
) -> tuple[float, float, int]:
    """Mean over cases of a measure of one column minus that of another, its standard error (NaN of one
    case), and of how many cases."""
    changes = list(_changes(cases, judged, rival, group, key))
    mean, count = nan_mean(changes), len(changes)
    if count < 2:
        return mean, math.nan, count
    return mean, math.sqrt(sum((c - mean) ** 2 for c in changes) / (count - 1) / count), count


def _changes(cases: Sequence[Mapping], judged: str, rival: str, group: str, key: str) -> Iterator[float]:
    for row in cases:
        new, old = (
            number(row["columns"].get(column, {}).get(group, {}).get(key)) for column in (judged, rival)
        )
        if not (math.isnan(new) or math.isnan(old)):
            yield new - old


def _change(change: tuple[float, float, int], form: str) -> str:
    mean, error, count = change
    if not count:
        return "-"
    return told(mean, f"+z{form}") + ("" if math.isnan(error) else f" ± {told(error, form)}")


def _ordered(measures: Mapping[str, object]) -> list[str]:
    """The grid first, the other version last."""
    return sorted(measures, key=lambda column: (column != GRID, column == OTHER))


def told(value: float, form: str) -> str:
    """A number; "-" where there is none."""
    return "-" if math.isnan(value) else format(value, form)


def _lines(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    return ["| " + " | ".join(row) + " |" for row in (header, tuple("---" for _ in header), *rows)]
