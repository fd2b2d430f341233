"""A folder of sets whose photos are words, and a run over it by workers that copy."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from langflash_core.batch.dispatch import Workers
from langflash_core.batch.ledger import Ledger, Row
from langflash_core.batch.order import Order
from langflash_core.batch.processes import LocalWorkers
from langflash_core.batch.run import jobs_of, left_to_do, run_jobs
from langflash_core.batch.sets import LEDGER, read_sets
from tests.batch.doings import open_copier


@dataclass
class Place:
    """Where a test's sets and output lie."""

    source: Path
    output: Path
    order: Order = field(default_factory=Order)

    def add(self, name: str, what: str = "well") -> Path:
        photo = self.source / name / "a.jpg"
        photo.parent.mkdir(parents=True, exist_ok=True)
        photo.write_text(what)
        return photo

    def run(
        self,
        count: int = 2,
        workers: Callable[[int], Workers] = lambda count: LocalWorkers(open_copier, count),
        tick: Callable[[Workers], None] = lambda _: None,
    ) -> list[Row]:
        """The rows that were made, in order of their end."""
        sets, rows = read_sets(self.source, self.output), []
        ledger = Ledger(self.output / LEDGER)
        to_do = left_to_do(jobs_of(sets, self.output, self.order), ledger)
        crew = workers(count)
        run_jobs(to_do, ledger, crew, [each.name for each in sets], rows.append, lambda: tick(crew))
        return rows

    def ledger(self) -> Sequence[Row]:
        return tuple(Ledger(self.output / LEDGER).rows.values())


@pytest.fixture
def place(tmp_path) -> Place:
    return Place(tmp_path / "sets", tmp_path / "out")
