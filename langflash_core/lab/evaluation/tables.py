"""Results as tables, alike for every judge: numbers of one version, or of two beside each other.

A *measure* is a number by its key, with a title for people and the form it is told in. What nobody measured
is null in JSON, NaN here, and "-" in a table.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from langflash_core.lab.training.measures import nan_mean

Numbers = Mapping[str, float | None]
Pairs = Sequence[tuple[float, float]]
"""A number of each case in the one version and in the other."""
Intervals = Mapping[str, Sequence[float] | None]
"""95 % of draws of scenes, low and high, by the path of a number in its result."""


def rounded(values: Mapping[str, float]) -> dict[str, float | None]:
    """Four digits; what could not be measured is null, because JSON has no NaN."""
    return {k: None if math.isnan(v) else round(v, 4) for k, v in values.items()}


def number(value: float | None) -> float:
    """Of plain JSON: null is NaN."""
    return math.nan if value is None else float(value)


@dataclass(frozen=True)
class Measure:
    """title: for people, one that begins with "..." goes on from the measure before; form: as `format` has
    it, or "share", which is told in percent."""

    title: str
    key: str
    form: str = ".3f"

    def told(self, value: float | None, sign: str = "") -> str:
        """A value; sign: before the form, of differences."""
        if value is None or math.isnan(value):
            return "-"
        if self.form == "share":
            return format(100 * value, f"{sign}.2f")
        return format(value, sign + self.form.removeprefix("+") if sign else self.form)


@dataclass(frozen=True)
class Table:
    """Texts; the first column names the row."""

    title: str
    header: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def table_lines(table: Table) -> list[str]:
    """Lines of Markdown."""
    rows = [table.header, tuple("---" for _ in table.header), *table.rows]
    lines = ["| " + " | ".join(text.replace("|", "/") for text in row) + " |" for row in rows]
    return [f"**{table.title}**", "", *lines] if table.title else lines


def markdown(tables: Iterable[Table], *before: str) -> str:
    """Tables that have rows, below some lines of text."""
    lines = [part for text in before for part in (text, "")]
    for table in tables:
        lines += [*table_lines(table), ""] if table.rows else []
    return "\n".join(lines).rstrip() + "\n"


def by_measure(title: str, corner: str, columns: Mapping[str, Numbers], measures: Sequence[Measure]) -> Table:
    """A row a measure that some column has; `columns`: numbers by what the column is called."""
    rows = []
    for measure in measures:
        values = [number(column.get(measure.key)) for column in columns.values()]
        if not all(map(math.isnan, values)):
            rows.append((measure.title, *map(measure.told, values)))
    return Table(title, (corner, *columns), rows)


def by_row(title: str, corner: str, rows: Mapping[str, Numbers], measures: Sequence[Measure]) -> Table:
    """A column a measure that some row has."""
    known = [m for m in measures if any(row.get(m.key) is not None for row in rows.values())]
    told = [(name, *(m.told(row.get(m.key)) for m in known)) for name, row in rows.items()]
    return Table(title, (corner, *(m.title for m in known)), told)


def cell(value: float | None) -> str:
    """Three digits; "-" where nothing could be measured."""
    return "-" if value is None else f"{value:.3f}"


def span(bounds: Sequence[float] | None) -> str:
    """(low to high), or nothing."""
    return "" if bounds is None else f"({bounds[0]:.3f} to {bounds[1]:.3f})"


def measures_table(
    title: str,
    rows: Sequence[tuple[str, str, str, str]],
    measures: Numbers,
    intervals: Intervals | None = None,
) -> Table:
    """Measures beside a trivial rival, with intervals where they are known; what was not taken is left out.

    Args:
        rows: text, key of the measure, name of the rival, its key.
    """
    kept = [
        (
            text,
            cell(measures[key]),
            span((intervals or {}).get(f"measures/{key}")),
            f"{cell(measures[rival_key])} ({rival})" if measures.get(rival_key) is not None else "",
        )
        for text, key, rival, rival_key in rows
        if measures.get(key) is not None
    ]
    columns = [0, 1, *([] if intervals is None else [2]), *([3] if any(row[3] for row in kept) else [])]
    header = ("measure", "value", "95 % of draws", "trivial rival")
    return Table(title, _chosen(header, columns), [_chosen(row, columns) for row in kept])


def _chosen(row: Sequence[str], columns: Sequence[int]) -> tuple[str, ...]:
    return tuple(row[column] for column in columns)


def labels_table(
    title: str,
    methods: Mapping[str, str],
    columns: Mapping[str, str],
    labels: Mapping[str, Numbers],
    intervals: Intervals | None = None,
) -> Table:
    """Methods by columns; columns that nobody has are left out."""
    known = [c for c in columns if any(row.get(c) is not None for row in labels.values())]
    draws = intervals or {}
    rows = [
        (
            text,
            *(
                f"{cell(labels[method].get(c))} {span(draws.get(f'labels/{method}/{c}'))}".strip()
                for c in known
            ),
        )
        for method, text in methods.items()
        if method in labels
    ]
    return Table(title, ("labels by", *(columns[c] for c in known)), rows)


def full_titles(measures: Iterable[Measure]) -> Iterator[Measure]:
    """With the title of the measure before in those that go on from it."""
    whole = ""
    for measure in measures:
        whole = whole if measure.title.startswith("...") else measure.title
        own = measure.title.replace("...", f"{whole},", 1) if measure.title.startswith("...") else whole
        yield Measure(own, measure.key, measure.form)


def difference(pairs: Pairs) -> tuple[float, float, int]:
    """Mean of the second minus the first over pairs without NaN, its standard error (NaN of less than two),
    and how many pairs these are."""
    changes = [new - old for old, new in pairs if not (math.isnan(old) or math.isnan(new))]
    mean, count = nan_mean(changes), len(changes)
    if count < 2:
        return mean, math.nan, count
    return mean, math.sqrt(sum((c - mean) ** 2 for c in changes) / (count - 1) / count), count


def told_difference(measure: Measure, pairs: Pairs) -> str:
    """Mean and standard error."""
    mean, error, _ = difference(pairs)
    return measure.told(mean, "+z") + ("" if math.isnan(error) else f" ± {measure.told(error)}")


def beside(corner: str, changes: Iterable[tuple[Measure, Pairs]]) -> Table:
    """Two versions over the cases that both have: means, and the mean difference with its standard error."""
    rows = []
    for measure, pairs in changes:
        kept = [pair for pair in pairs if not any(map(math.isnan, pair))]
        if kept:
            old, new = (nan_mean(side) for side in zip(*kept, strict=True))
            rows.append((measure.title, measure.told(old), measure.told(new), told_difference(measure, kept)))
    return Table("", (corner, "before", "after", "difference"), rows)
