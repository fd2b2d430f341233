"""Jobs to workers: never more under way than there are workers, and each lost one tried once more."""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

TRIES = 2
_TICK = 0.5  # seconds without news until whoever watches is told


@dataclass(frozen=True)
class Job:
    """A set to be done. folder: where its files go, all or none. fingerprint: of photos and options."""

    name: str
    photos: tuple[Path, ...]
    folder: Path
    fingerprint: str = ""


@dataclass(frozen=True)
class Made:
    """What a worker says of a job; fields as the ledger's row has them. A `reason` means that it failed."""

    reason: str = ""
    seconds: float = 0.0
    gaussians: int = 0
    groups: int = 0
    found: str = ""
    memory_mb: int = 0
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Lost:
    """The worker died over a job. how: what is known of its end."""

    how: str


Make = Callable[[Job], Made]
OpenMaker = Callable[[], AbstractContextManager[Make]]
"""Called once in each worker; must be possible to pickle."""


@runtime_checkable
class Workers(Protocol):
    """Who does jobs, one at a time each. A worker that died is replaced. What its methods do is said here."""

    count: int

    @property
    def busy(self) -> Sequence[Job]:
        """What is under way."""
        ...

    def start(self, job: Job) -> None:
        """Give a job to an idle worker; there is one, as long as fewer than `count` are busy."""
        ...

    def wait(self, seconds: float) -> list[tuple[Job, Made | Lost]]:
        """What has ended; waits at most so long for the first."""
        ...

    def close(self) -> None:
        """End all workers, also in the middle of a job."""
        ...


@dataclass(frozen=True)
class Ended:
    """A job that will not be tried again. retried: how often it was begun anew."""

    job: Job
    made: Made
    retried: int


def dispatch(
    jobs: Iterable[Job], workers: Workers, tick: Callable[[], None] = lambda: None
) -> Iterator[Ended]:
    """Do all jobs, in order as far as workers come free; yields each as it ends.

    Args:
        tick: called whenever something happened, and twice a second.
    """
    waiting, lost = deque(jobs), Counter[str]()
    while waiting or workers.busy:
        while waiting and len(workers.busy) < workers.count:
            workers.start(waiting.popleft())
        tick()
        for job, outcome in workers.wait(_TICK):
            if isinstance(outcome, Made):
                yield Ended(job, outcome, lost.pop(job.name, 0))
                continue
            lost[job.name] += 1
            if lost[job.name] < TRIES:
                waiting.appendleft(job)
            else:
                yield Ended(job, Made(_death_message(outcome)), TRIES - 1)
    tick()


def _death_message(outcome: Lost) -> str:
    return f"its worker died twice ({outcome.how}); if memory is short, try fewer --workers"
