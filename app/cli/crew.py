"""Who works off the jobs of a run: processes of this machine, or actors of a Ray cluster."""

import os
from argparse import Namespace
from collections.abc import Callable

from langflash_core.batch.dispatch import Workers


def crew(args: Namespace, opening: Callable[[int], Callable], jobs: int, most: int) -> Workers:
    """Never more workers than jobs.

    Args:
        args: with `workers`, `address` and `device`. opening: what a worker of so many threads begins with.
        most: processes of this machine where `workers` does not say how many.
    """
    if args.address is not None:
        from langflash_core.batch.cluster import RayWorkers

        card, count = args.device == "cuda", None if args.workers is None else min(args.workers, jobs)
        return RayWorkers(opening(1), args.address, count, threads=1, card=card)
    from langflash_core.batch.processes import LocalWorkers

    count = min(args.workers or most, jobs)
    return LocalWorkers(opening(threads_said() or max(1, processors() // count)), count)


def threads_said() -> int | None:
    """How many threads a process shall have, where the environment says that."""
    said = os.environ.get("OMP_NUM_THREADS", "")
    return int(said) if said.isdecimal() and int(said) else None


def processors() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
