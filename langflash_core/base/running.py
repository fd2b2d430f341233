"""Work under way: what is done is told, each stage is timed, and a person may stop it in between."""

import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from langflash_core.errors import Cancelled

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of the whole that is done, in [0, 1]."""


Kept = Callable[[str, Callable[[], Mapping[str, Any]]], Mapping[str, Any]]
"""The result of a named step, as `keeping.Keep` gives it: what was kept, else what the step makes."""
T = TypeVar("T")
_TOLD_FROM, _SURE_FROM = 3.0, 0.05  # seconds, and share of the whole, before which nobody knows what is left


def time_left(seconds: float, fraction: float) -> str:
    """What is left of work of which so much was done in so long: "about 40 s left"; nothing where that says
    nothing yet."""
    if seconds < _TOLD_FROM or not _SURE_FROM <= fraction < 1:
        return ""
    rest = seconds * (1 - fraction) / fraction
    return f"about {rest:.0f} s left" if rest < 90 else f"about {rest / 60:.0f} min left"


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
    kept: Kept = lambda name, make: make()

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

    def counted(self, name: str, what: str, items: Collection[T], begin: float = 0.0) -> Iterator[T]:
        """The items of a stage one after the other, each told before, with its number: "refinement: photo 3
        of 32"; each may be where the run stops. begin: share of the stage that was done before."""
        told = self.within(name)
        for number, item in enumerate(items):
            share = begin + (1 - begin) * number / len(items)
            told(f"{name}: {what} {number + 1} of {len(items)}", share)
            yield item

    def within(self, name: str) -> Progress:
        """Progress of a stage's own steps, as a part of the whole; each may be where the run stops."""
        start = self.begins.get(name, 0.0)
        end = min((begin for begin in self.begins.values() if begin > start), default=1.0)

        def told(step: str, fraction: float) -> None:
            self.check()
            self.report(step, start + (end - start) * fraction)

        return told
