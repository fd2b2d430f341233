"""A run over many sets: what is left to do, doing it, and the ledger and summary of it."""

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path

from langflash_core.batch.dispatch import Ended, Job, Workers, dispatch
from langflash_core.batch.ledger import DONE, FAILED, Ledger, Row
from langflash_core.batch.order import Order, stamp
from langflash_core.batch.sets import PhotoSet
from langflash_core.batch.summary import write_summary

SCENE = "scene.langflash"  # in each set's folder


def jobs_of(sets: Sequence[PhotoSet], output: Path, order: Order) -> list[Job]:
    """A job a set, with absolute paths: a worker may live in another folder."""
    jobs = []
    for each in sets:
        photos, folder = tuple(photo.absolute() for photo in each.photos), output.absolute() / each.name
        jobs.append(Job(each.name, photos, folder, fingerprint(each.photos, order)))
    return jobs


def fingerprint(photos: Sequence[Path], order: Order) -> str:
    """Changes with the order, and with a photo's name, size or time of change; not with their folder."""
    content = json.dumps([order.words(), [stamp(photo) for photo in photos]], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()[:16]


def left_to_do(jobs: Sequence[Job], ledger: Ledger) -> list[Job]:
    """Without those that are done, from the same photos by the same options; what failed is tried again."""
    return [job for job in jobs if not _is_done(job, ledger.rows.get(job.name))]


def _is_done(job: Job, row: Row | None) -> bool:
    same = row is not None and row.status == DONE and row.fingerprint == job.fingerprint
    return same and (job.folder / SCENE).is_file()


def run_jobs(
    jobs: Sequence[Job],
    ledger: Ledger,
    workers: Workers,
    names: Sequence[str],
    told: Callable[[Row], None],
    tick: Callable[[], None],
) -> None:
    """Do jobs and note each as it ends; whatever stops this, ledger and summary are in order afterwards.

    Args:
        names: of sets, in the order in which ledger and summary have them.
        told: called with every row. tick: called whenever something happened, and twice a second.

    Raises:
        OutputError: ledger or summary cannot be written.
    """
    ledger.begin(job.name for job in jobs)
    try:
        for ended in dispatch(jobs, workers, tick):
            row = _row(ended)
            ledger.add(row)
            told(row)
    finally:
        workers.close()
        finish(ledger, names)


def finish(ledger: Ledger, names: Sequence[str]) -> None:
    """Put the ledger in order and write the summary beside it.

    Raises:
        OutputError: one cannot be written.
    """
    ledger.settle(names)
    write_summary(list(ledger.rows.values()), ledger.path.parent, ledger.item)


def _row(ended: Ended) -> Row:
    job, made = ended.job, ended.made
    reason = made.reason
    if reason and job.folder.exists():
        reason += "; what lies in its folder is from before"
    return Row(
        job.name,
        FAILED if reason else DONE,
        reason=reason,
        retried=ended.retried,
        seconds=made.seconds,
        photos=len(job.photos),
        gaussians=made.gaussians,
        groups=made.groups,
        found=made.found,
        memory_mb=made.memory_mb,
        warnings=" | ".join(made.warnings),
        fingerprint=job.fingerprint,
    )
