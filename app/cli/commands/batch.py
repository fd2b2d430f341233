"""`langflash batch`: many sets of photos, each as `reconstruct`, `query` and `export` would do it."""

import os
from argparse import Namespace
from collections.abc import Sequence
from functools import partial
from typing import TextIO

from langflash_core.__main__ import in_program
from langflash_core.batch.dispatch import Job, Workers
from langflash_core.batch.ledger import FAILED, Ledger
from langflash_core.batch.order import Order
from langflash_core.batch.run import finish, jobs_of, left_to_do, run_jobs
from langflash_core.batch.sets import LEDGER, SUMMARY, read_sets
from langflash_core.errors import InputError, PromptError, WeightsError
from langflash_core.files import held_alone
from langflash_core.formats import ALL_OUT, ANSWERS_OUT, FILMS_OUT

from ..files import check_folder, readable_file
from ..report import say_error, write_json
from ..table import ProgressTable
from .query import spoken

INTERRUPTED = 130
MEMORY = {"mini": 1_500_000_000, "full": 7_000_000_000}  # bytes that a worker may come to hold
EXPORTS = tuple(kind for kind in ALL_OUT if kind != ".langflash")  # the scene itself is always written


def run(args: Namespace, out: TextIO) -> int:
    """Do what is left to do of all sets; the exit code: 0 all are done, 1 some failed, 130 after Ctrl-C.

    Raises:
        LangFlashError: sets, options, output or cluster cannot be used.
    """
    order = _order(args)
    check_folder(args.output)
    sets = read_sets(args.sets, args.output)
    jobs = jobs_of(sets, args.output, order)
    with held_alone(args.output):
        ledger = Ledger(args.output / LEDGER)
        to_do = left_to_do(jobs, ledger)
        stopped = not _worked_off(args, order, to_do, ledger, [each.name for each in sets])
    return _told(args, ledger, jobs, len(jobs) - len(to_do), stopped, out)


def _worked_off(
    args: Namespace, order: Order, to_do: Sequence[Job], ledger: Ledger, names: Sequence[str]
) -> bool:
    """Whether it came to its end; Ctrl-C stops it."""
    if not to_do:
        ledger.begin(())
        finish(ledger, names)
        return True
    workers = _workers(args, order, len(to_do))
    try:
        with ProgressTable(len(to_do), workers) as table:
            run_jobs(to_do, ledger, workers, names, table.told, table.tick)
    except KeyboardInterrupt:
        return False
    return True


def _order(args: Namespace) -> Order:
    """The options, checked as far as it can be done without torch.

    Raises:
        LangFlashError: one cannot be used, or what it needs is not installed.
    """
    prompts = tuple(spoken(args.prompt or []))
    exports = tuple(dict.fromkeys(args.export or []))
    _check_exports(exports, prompts)
    weights = None if args.weights is None else args.weights.absolute()
    if weights is not None:
        readable_file(weights, "checkpoint", WeightsError)
    if args.preset == "mini":
        from langflash_core.network.checkpoints.stored import read_header, weights_file

        read_header(weights_file(args.preset, weights))
    return Order(
        preset=args.preset,
        weights=weights,
        size=args.size,
        fov=args.fov,
        device=args.device,
        prompts=prompts,
        exports=exports,
        backend=args.backend,
    )


def _check_exports(exports: Sequence[str], prompts: Sequence[str]) -> None:
    for name in exports:
        if name not in EXPORTS:
            raise InputError(f"--export {name} is not an ending that is written; choose {', '.join(EXPORTS)}")
        if name in ANSWERS_OUT and not prompts:
            raise PromptError(f'--export {name} needs a phrase; add --prompt "armchair"')
    if set(FILMS_OUT) & set(exports):
        from ..video import check_encoder

        check_encoder()


def _workers(args: Namespace, order: Order, jobs: int) -> Workers:
    """Processes of this machine, or actors of a cluster; never more than there are jobs."""
    if args.address is not None:
        from langflash_core.batch.cluster import RayWorkers

        card, count = args.device == "cuda", None if args.workers is None else min(args.workers, jobs)
        return RayWorkers(_opening(order, 1), args.address, count, threads=1, card=card)
    from langflash_core.batch.processes import LocalWorkers

    processors, said = _processors(), _threads_said()
    default = _as_memory_allows(max(1, processors // (said or 1)), order.preset)
    count = min(args.workers or default, jobs)
    return LocalWorkers(_opening(order, said or max(1, processors // count)), count)


def _as_memory_allows(count: int, preset: str) -> int:
    """So many workers, or fewer that fit into this machine's memory."""
    try:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # it cannot be asked here
        return count
    return max(1, min(count, memory // MEMORY[preset]))


def _threads_said() -> int | None:
    """How many threads a process shall have, where the environment says that."""
    said = os.environ.get("OMP_NUM_THREADS", "")
    return int(said) if said.isdecimal() and int(said) else None


def _opening(order: Order, threads: int) -> partial:
    return partial(in_program, "cli.places", "open_maker", order, threads)


def _processors() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _told(
    args: Namespace, ledger: Ledger, jobs: Sequence[Job], before: int, stopped: bool, out: TextIO
) -> int:
    """Say what became of the sets; the exit code."""
    rows = [ledger.rows[job.name] for job in jobs if job.name in ledger.rows]
    failed = sum(row.status == FAILED for row in rows)
    document = {
        "output": str(args.output),
        "sets": len(jobs),
        "done": len(rows) - failed,
        "failed": failed,
        "done_before": before,
        "ledger": str(args.output / LEDGER),
        "summary": str(args.output / SUMMARY),
    }
    if args.json:
        write_json(document, out)
    else:
        print(_sentence(document), file=out)
    if stopped:
        say_error("stopped; the same command goes on from here")
        return INTERRUPTED
    return int(failed > 0)


def _sentence(document: dict) -> str:
    done, total, before = document["done"], document["sets"], document["done_before"]
    sentence = f"{document['output']}: {done} of {total} sets done"
    sentence += f" ({before} before)" if before else ""
    sentence += f", {document['failed']} failed" if document["failed"] else ""
    return f"{sentence}; see {document['summary']}"
