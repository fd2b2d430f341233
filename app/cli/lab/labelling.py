"""What a worker of `langflash lab labels` does with one clip."""

import contextlib
import io
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import torch

from langflash_core.base.memory import peak_memory_mb
from langflash_core.base.optional import optional_packages
from langflash_core.base.running import Progress
from langflash_core.batch.dispatch import Job, Made
from langflash_core.lab.labels.clips import ClipPlace
from langflash_core.lab.labels.making import LabelMaker
from langflash_core.lab.labels.order import LabelOrder

from ..report import explained


def _silent(stage: str, fraction: float) -> None:
    pass


@contextlib.contextmanager
def open_labeller(
    order: LabelOrder, source: Path, keyed: bool, threads: int | None = None, progress: Progress = _silent
) -> Iterator[Callable[[Job], Made]]:
    """What labels one clip after the other in this process; models are read with the first.

    Args:
        source: what holds the clips. keyed: jobs are videos of its chunks, not folders.
        threads: of torch and of OpenCV each; None: theirs.
    """
    if threads is not None:
        torch.set_num_threads(threads)
        cv2.setNumThreads(threads)
    makers: list[LabelMaker] = []

    def make(job: Job) -> Made:
        """Fill the job's folder, or say why not; no error leaves this, and nothing is printed."""
        start = time.perf_counter()
        folder = source if keyed else _folder(job.photos[0])
        place = ClipPlace(job.name, folder, job.photos, job.name if keyed else "")
        try:
            with contextlib.redirect_stdout(io.StringIO()), optional_packages():
                if not makers:
                    makers.append(LabelMaker(order))
                labels, measured = makers[0].fill(place, job.folder, progress)
        except Exception as error:
            return Made(explained(error), time.perf_counter() - start)
        return Made(
            seconds=time.perf_counter() - start,
            groups=len(labels.objects),
            found=f"{measured.coverage.mean():.0%} covered, {measured.steady.mean():.1%} steady",
            memory_mb=peak_memory_mb() or 0,
        )

    yield make


def _folder(frame: Path) -> Path:
    """Of the clip that a frame is from."""
    return frame.parent.parent if frame.parent.name == "images" else frame.parent
