"""`langflash lab labels`: what is where in every frame of clips, and what it is."""

from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TextIO

from langflash_core.__main__ import in_program
from langflash_core.base.files import check_folder, filled_atomically, held_alone
from langflash_core.batch.dispatch import Job, Lost, Made
from langflash_core.batch.ledger import DONE, FAILED, Ledger
from langflash_core.batch.run import finish, run_jobs
from langflash_core.batch.sets import LEDGER, SUMMARY
from langflash_core.errors import InputError
from langflash_core.lab.labels.clips import INDEX, ClipPlace, find_clips
from langflash_core.lab.labels.making import REPORT
from langflash_core.lab.labels.order import LabelOrder
from langflash_core.lab.labels.re10k import enrich, labels_inside
from langflash_core.lab.labels.storage import LABELS, write_labels

from ..crew import crew
from ..report import INTERRUPTED, ProgressBar, say_error, write_json
from ..table import ProgressTable
from .models import ordered


def run(args: Namespace, out: TextIO) -> int:
    """Label what is not labelled yet; the exit code: 0 all is done, 1 some failed, 130 after Ctrl-C.

    Raises:
        LangFlashError: clips, options or output cannot be used.
    """
    check_folder(args.output)
    keyed = (args.source / INDEX).is_file()
    if (args.extract or args.enrich) and not keyed:
        raise InputError(f"{args.source} has no {INDEX}, so there are no chunks in it; give a split of them")
    if args.extract:
        return _extracted(args, out)
    order = replace(ordered(args), start=args.start, count=args.count, step=args.step, device=args.device)
    places = find_clips(args.source)
    if args.output.resolve() in {args.source.resolve(), *(place.path.resolve() for place in places)} and (
        not keyed
    ):
        raise InputError(f"{args.output} holds the frames; choose another -o")
    jobs = _jobs(places, args.output, order)
    with held_alone(args.output):
        ledger = Ledger(args.output / LEDGER, "clip")
        to_do = [job for job in jobs if not _is_done(job, ledger)]
        stopped = not _worked_off(args, order, to_do, ledger, [job.name for job in jobs], keyed)
        enriched = 0 if stopped or not args.enrich else _enriched(args, places, order, ledger)
    return _told(args, ledger, jobs, len(jobs) - len(to_do), enriched, stopped, out)


def _jobs(places: Sequence[ClipPlace], output: Path, order: LabelOrder) -> list[Job]:
    """A job a clip, with absolute paths; names are folders."""
    return [
        Job(
            place.name,
            tuple(file.absolute() for file in place.files),
            output.absolute() / place.name,
            order.fingerprint(place.files),
        )
        for place in places
    ]


def _is_done(job: Job, ledger: Ledger) -> bool:
    row = ledger.rows.get(job.name)
    same = row is not None and row.status == DONE and row.fingerprint == job.fingerprint
    return same and (job.folder / LABELS).is_file()


def _worked_off(
    args: Namespace, order: LabelOrder, to_do: list[Job], ledger: Ledger, names: list[str], keyed: bool
) -> bool:
    """Whether it came to its end; Ctrl-C stops it."""
    if not to_do:
        ledger.begin(())
        finish(ledger, names)
        return True
    source = args.source.absolute()
    opening = partial(in_program, "cli.lab.labelling", "open_labeller", order, source, keyed)
    try:
        if args.workers is None and args.address is None:
            with ProgressBar() as bar:
                workers = Here(partial(opening, None, bar))
                run_jobs(to_do, ledger, workers, names, lambda row: None, lambda: None)
            return True
        workers = crew(args, lambda threads: partial(opening, threads), len(to_do), most=1)
        with ProgressTable(len(to_do), workers, ledger.item) as table:
            run_jobs(to_do, ledger, workers, names, table.told, table.tick)
    except KeyboardInterrupt:
        return False
    return True


def _enriched(args: Namespace, places: Sequence[ClipPlace], order: LabelOrder, ledger: Ledger) -> int:
    """Put what was labelled so into the chunks; rows know these as they are afterwards, so that it is not
    done again."""
    done = {job.name for job in _jobs(places, args.output, order) if _is_done(job, ledger)}
    count = enrich(args.source, args.output, done)
    jobs = _jobs(places, args.output, order)
    for job in jobs:
        if job.name in done:
            ledger.rows[job.name] = replace(ledger.rows[job.name], fingerprint=job.fingerprint)
    ledger.settle([job.name for job in jobs])
    return count


class Here:
    """One worker that is this very process: what it is given is done when it is waited for."""

    count = 1

    def __init__(self, open_maker: Callable) -> None:
        self._opened = open_maker()
        self._make = self._opened.__enter__()
        self._jobs: list[Job] = []

    @property
    def busy(self) -> Sequence[Job]:
        """What waits."""
        return tuple(self._jobs)

    def start(self, job: Job) -> None:
        """Take a job."""
        self._jobs.append(job)

    def wait(self, seconds: float) -> list[tuple[Job, Made | Lost]]:
        """Do it."""
        return [(job, self._make(job)) for job in [self._jobs.pop() for _ in self._jobs[:]]]

    def close(self) -> None:
        """Nothing lasts."""
        self._opened.__exit__(None, None, None)


def _extracted(args: Namespace, out: TextIO) -> int:
    """Take labels out of chunks: a folder a video."""
    count = 0
    for labels in labels_inside(args.source):
        with filled_atomically(args.output / labels.name) as staging:
            write_labels(labels, staging)
        count += 1
    if not count:
        raise InputError(f"no video of {args.source} holds labels; put them there with --enrich")
    document = {"output": str(args.output), "videos": count}
    if args.json:
        write_json(document, out)
    else:
        print(f"{args.output}: labels of {count} videos", file=out)
    return 0


def _told(
    args: Namespace,
    ledger: Ledger,
    jobs: Sequence[Job],
    before: int,
    enriched: int,
    stopped: bool,
    out: TextIO,
) -> int:
    """Say what became of the clips; the exit code."""
    rows = [ledger.rows[job.name] for job in jobs if job.name in ledger.rows]
    failed = [row for row in rows if row.status == FAILED]
    document = {
        "output": str(args.output),
        "clips": len(jobs),
        "done": len(rows) - len(failed),
        "failed": len(failed),
        "done_before": before,
        "objects": sum(row.groups for row in rows),
        "seconds": round(sum(row.seconds for row in rows), 2),
        "enriched": enriched,
        "ledger": str(args.output / LEDGER),
        "summary": str(args.output / SUMMARY),
    }
    if args.json:
        write_json(document, out)
    else:
        print(_sentence(document), file=out)
    told_by_table = args.workers is not None or args.address is not None
    if len(jobs) == 1 and failed and not told_by_table:
        say_error(failed[0].reason)
    if stopped:
        say_error("stopped; the same command goes on from here")
        return INTERRUPTED
    return int(bool(failed))


def _sentence(document: dict) -> str:
    sentence = f"{document['output']}: {document['done']} of {document['clips']} clips labelled"
    sentence += f" ({document['done_before']} before)" if document["done_before"] else ""
    sentence += f", {document['failed']} failed" if document["failed"] else ""
    sentence += f", {document['objects']} objects in {document['seconds']:.0f} s"
    sentence += f", {document['enriched']} videos enriched" if document["enriched"] else ""
    return f"{sentence}; see {document['summary']} and each clip's {REPORT}"
