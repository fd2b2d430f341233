"""`langflash batch`: many sets of photos, each as `reconstruct`, `query` and `export` would do it."""

import os
from argparse import Namespace
from collections.abc import Sequence
from functools import partial
from typing import TextIO

from langflash_core.__main__ import in_program
from langflash_core.base.files import check_folder, held_alone, readable_file
from langflash_core.base.outputs import ALL_OUT, output_of
from langflash_core.base.request import trim_phrases
from langflash_core.batch.dispatch import Job
from langflash_core.batch.ledger import FAILED, Ledger
from langflash_core.batch.order import Order, export_path
from langflash_core.batch.run import finish, jobs_of, left_to_do, run_jobs
from langflash_core.batch.sets import LEDGER, SUMMARY, read_sets
from langflash_core.errors import InputError, PromptError, WeightsError

from ..crew import crew, processors, threads_said
from ..report import INTERRUPTED, say_error, tell
from ..table import ProgressTable

MEMORY = {"mini": 1_500_000_000, "full": 7_000_000_000}  # bytes that a worker may come to hold
EXPORTS = tuple(kind for kind in ALL_OUT if kind != ".langflash")  # the scene itself is always written


def run(args: Namespace, out: TextIO) -> int:
    """Do what is left to do of all sets; the exit code: 0 all are done, 1 some failed, 130 after Ctrl-C."""
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
    most = _as_memory_allows(max(1, processors() // (threads_said() or 1)), order.preset)

    def opening(threads: int) -> partial:
        return partial(in_program, "cli.places", "open_maker", order, threads)

    workers = crew(args, opening, len(to_do), most)
    try:
        with ProgressTable(len(to_do), workers) as table:
            run_jobs(to_do, ledger, workers, names, table.told, table.tick)
    except KeyboardInterrupt:
        return False
    return True


def _order(args: Namespace) -> Order:
    """The options, checked as far as it can be done without torch."""
    prompts = tuple(trim_phrases(args.prompt or []))
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
        detail=args.detail,
        gaussians=args.gaussians,
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
        kind = output_of(export_path(name), None, asked=False)
        if kind is not None and kind.needs_phrases and not prompts:
            raise PromptError(f'--export {name} needs a phrase; add --prompt "armchair"')
        if kind is not None and kind.moves:
            from langflash_core.writing.films import check_encoder

            check_encoder()


def _as_memory_allows(count: int, preset: str) -> int:
    """So many workers, or fewer that fit into this machine's memory."""
    try:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # it cannot be asked here
        return count
    return max(1, min(count, memory // MEMORY[preset]))


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
    done = f"{args.output}: {document['done']} of {len(jobs)} sets done"
    done += f" ({before} before)" if before else ""
    done += f", {failed} failed" if failed else ""
    tell(args, document, [f"{done}; see {document['summary']}"], out)
    if stopped:
        say_error("stopped; the same command continues from here")
        return INTERRUPTED
    return int(failed > 0)
