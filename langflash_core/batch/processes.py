"""Workers as processes of this machine. Each starts afresh, so that none inherits another's threads."""

import multiprocessing
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from langflash_core.batch.dispatch import Job, Lost, Made, OpenMaker

_PATIENCE = 5.0  # seconds for a process to end


class LocalWorkers:
    """So many processes, each begun when it is first needed.

    Every process has a pipe of its own: one that is killed breaks nothing that another one uses.
    """

    def __init__(self, open_maker: OpenMaker, count: int) -> None:
        self.count = count
        self._open_maker = open_maker
        self._context = multiprocessing.get_context("spawn")
        self._processes: dict[Connection, BaseProcess] = {}
        self._jobs: dict[Connection, Job] = {}

    @property
    def busy(self) -> Sequence[Job]:
        return tuple(self._jobs.values())

    def start(self, job: Job) -> None:
        """Give a job to an idle process, or to a new one."""
        for pipe in [pipe for pipe in self._processes if pipe not in self._jobs]:
            try:
                pipe.send(job)
            except OSError:  # it died meanwhile
                self._end(pipe)
                continue
            self._jobs[pipe] = job
            return
        pipe = self._begin()
        self._jobs[pipe] = job
        with suppress(OSError):  # that it died is seen by `wait`
            pipe.send(job)

    def wait(self, seconds: float) -> list[tuple[Job, Made | Lost]]:
        ended, ready = [], wait(list(self._jobs), seconds)
        for pipe in [pipe for pipe in self._jobs if pipe in ready]:
            job = self._jobs.pop(pipe)
            try:
                outcome = pipe.recv()
            except (EOFError, OSError):
                outcome = Lost(self._end(pipe))
            ended.append((job, outcome))
        return ended

    def close(self) -> None:
        """End all processes, those in the middle of a job at once."""
        for pipe in self._jobs:
            self._processes[pipe].kill()
        self._jobs.clear()
        for pipe in list(self._processes):
            self._end(pipe)

    def _begin(self) -> Connection:
        own, other = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(other, self._open_maker), daemon=True)
        with _deaf():
            process.start()
        other.close()  # else its end would never be noticed
        self._processes[own] = process
        return own

    def _end(self, pipe: Connection) -> str:
        """Close a process's pipe, at which it ends; how it ended."""
        process = self._processes.pop(pipe)
        pipe.close()
        process.join(_PATIENCE)
        if process.is_alive():
            process.kill()
            process.join()
        code = process.exitcode or 0
        process.close()
        return f"signal {-code}" if code < 0 else f"exit code {code}"


@contextmanager
def _deaf() -> Iterator[None]:
    """Processes begun inside never hear Ctrl-C: it is the parent that ends them."""
    try:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    except ValueError:  # not the main thread, which alone may say so
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _serve(pipe: Connection, open_maker: OpenMaker) -> None:
    """A worker's life: jobs until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, BrokenPipeError), open_maker() as make:
        while True:
            pipe.send(make(pipe.recv()))
