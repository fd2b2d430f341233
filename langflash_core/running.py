"""Work under way: what is done is told, each stage is timed, and a person may stop it in between."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from langflash_core.errors import Cancelled

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of the whole that is done, in [0, 1]."""


def evenly(stages: Sequence[str]) -> dict[str, float]:
    """Where each of some stages begins in the whole if all take equally long."""
    return {name: place / len(stages) for place, name in enumerate(stages)}


@dataclass
class Run:
    """Stages in order, by where each begins in the whole; `timings`, seconds, as they end.

    A stage may be entered again; its seconds add up.
    """

    begins: Mapping[str, float]
    progress: Progress | None = None
    cancelled: Callable[[], bool] | None = None
    timings: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """One stage.

        Raises:
            Cancelled: `cancelled()` became true before it.
        """
        self.check()
        self.report(name, self.begins[name])
        start = time.perf_counter()
        yield
        self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - start

    def check(self) -> None:
        """Stop here if asked to.

        Raises:
            Cancelled: `cancelled()` became true.
        """
        if self.cancelled is not None and self.cancelled():
            raise Cancelled("the reconstruction was cancelled; nothing was written")

    def report(self, name: str, fraction: float) -> None:
        """Tell what is being done."""
        if self.progress is not None:
            self.progress(name, fraction)

    def within(self, name: str) -> Progress:
        """Progress of a stage's own steps, as a part of the whole; each may be where the run stops."""
        start = self.begins[name]
        end = min((begin for begin in self.begins.values() if begin > start), default=1.0)

        def told(step: str, fraction: float) -> None:
            self.check()
            self.report(step, start + (end - start) * fraction)

        return told
