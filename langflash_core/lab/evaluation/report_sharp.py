"""The section of a report that holds pictures beside photos at the photos' size, kept subject by subject."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from torch import Tensor

from langflash_core.lab.evaluation.report_parts import Table
from langflash_core.lab.evaluation.sharp import Bench, judge, summary
from langflash_core.lab.evaluation.sharp_pictures import sharp_sight
from langflash_core.lab.evaluation.sharp_subjects import Subject
from langflash_core.lab.evaluation.sharp_tables import GROUPS, means_table
from langflash_core.lab.evaluation.sights import Look
from langflash_core.lab.evaluation.tallies import Shelf, collected


@dataclass
class Tally:
    """Rows of `sharp.judge`, one a subject."""

    rows: list[dict] = field(default_factory=list)


def sharp_tallies(
    subjects: Iterable[Subject], bench: Bench, shelf: Shelf | None = None, look: Look | None = None
) -> Iterator[tuple[str, Tally]]:
    """Name and tally of every subject, in order; those on the shelf are not judged again.

    Raises:
        InputError: a photo or a way cannot be used. WeightsError: the checkpoint does not fit.
    """

    def judged(subject: Subject) -> Tally:
        seen: dict[str, Mapping[str, Tensor]] = {}
        row = judge(subject, bench, seen.__setitem__)
        if look is not None:
            look(sharp_sight(subject.name, seen[subject.name], row, bench.ways[-1]))
        return Tally([row])

    yield from collected(((subject.name, subject) for subject in subjects), judged, shelf)


def sharp_summary(tally: Tally) -> dict:
    """Means over subjects by column and group, without the subjects; plain JSON."""
    return {"measures": summary(tally.rows)["measures"]}


def sharp_report_tables(result: Mapping) -> tuple[Table, ...]:
    """A table a group that was judged."""
    tables = []
    for group, (title, _) in GROUPS.items():
        header, rows = means_table(result["measures"], group)
        if rows:
            tables.append(Table(title, header, rows))
    return tuple(tables)
