"""Workers on a Ray cluster (extra `cluster`): actors, each with a processor or more of its own.

All machines see the photos and the output under the same paths, and have LangFlash installed.
"""

import logging
import socket
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

from langflash_core.base.optional import optional_packages
from langflash_core.batch.dispatch import Job, Lost, Made, OpenMaker
from langflash_core.errors import InputError

LOCAL = "local"  # the address of a cluster on this machine, begun for this run
_PATIENCE = 10.0  # seconds for a machine to answer


class RayWorkers:
    """So many actors. One that died is replaced here and not by Ray, so that the loss is counted."""

    def __init__(
        self, open_maker: OpenMaker, address: str, count: int | None, *, threads: int, card: bool = False
    ) -> None:
        """Join a cluster.

        Args:
            address: as `ray.init` takes it; "local" begins one here.
            count: of actors, at most as many as the cluster has room for; None: so many.
            threads: processors for each. card: each needs a graphics card.

        Raises:
            InputError: there is no cluster, or no room in it.
            MissingPackageError: Ray is not installed.
        """
        with optional_packages():
            import ray  # pyright: ignore[reportMissingImports]
        self._ray = ray
        _check_address(address)
        processors = count * threads if count and address == LOCAL else None
        try:
            ray.init(
                address,
                num_cpus=processors,
                include_dashboard=False,
                log_to_driver=False,
                logging_level=logging.ERROR,
            )
        except (ConnectionError, ValueError, RuntimeError) as problem:
            raise InputError(
                f"there is no Ray cluster at {address} ({problem}); check --address"
            ) from problem
        free = ray.cluster_resources()
        room = int(free.get("CPU", 0) // threads)
        room = min(room, int(free.get("GPU", 0))) if card else room
        if not room:
            ray.shutdown()
            raise InputError(f"the Ray cluster at {address} has no room for a worker; check --workers")
        self.count = min(count or room, room)
        self._open_maker = open_maker
        self._actor = ray.remote(num_cpus=threads, num_gpus=int(card), max_restarts=0)(_Server)
        self._idle: list[Any] = []
        self._jobs: dict[Any, tuple[Job, Any]] = {}  # what is awaited, to its job and actor

    @property
    def busy(self) -> Sequence[Job]:
        return tuple(job for job, _ in self._jobs.values())

    def start(self, job: Job) -> None:
        """Give a job to an idle actor, or to a new one."""
        actor = self._idle.pop() if self._idle else self._actor.remote(self._open_maker)
        self._jobs[actor.make.remote(job)] = job, actor

    def wait(self, seconds: float) -> list[tuple[Job, Made | Lost]]:
        ready, _ = self._ray.wait(list(self._jobs), timeout=seconds)
        return [self._result(reference) for reference in ready]

    def close(self) -> None:
        """End all actors, also in the middle of a job, and leave the cluster."""
        for actor in (*self._idle, *(actor for _, actor in self._jobs.values())):
            self._ray.kill(actor)
        self._idle.clear()
        self._jobs.clear()
        self._ray.shutdown()

    def _result(self, reference: Any) -> tuple[Job, Made | Lost]:
        job, actor = self._jobs.pop(reference)
        try:
            made = self._ray.get(reference)
        except self._ray.exceptions.RayError as problem:
            return job, Lost(type(problem).__name__)
        self._idle.append(actor)
        return job, made


class _Server:
    """What lives in an actor."""

    def __init__(self, open_maker: OpenMaker) -> None:
        self._make = ExitStack().enter_context(open_maker())

    def make(self, job: Job) -> Made:
        return self._make(job)


def _check_address(address: str) -> None:
    """Knock where a port is named: Ray itself would for minutes."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon or not port.isdecimal():
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE).close()
    except (OSError, OverflowError) as problem:
        raise InputError(f"there is no Ray cluster at {address} ({problem}); check --address") from problem
