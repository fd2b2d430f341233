"""Cancel in every stage of a reconstruction: at once for the person, soon for the machine."""

import gc
import itertools
import math
import os
import sys
import time
from pathlib import Path

import pytest

from app.window.scene import commands as show
from app.window.scene import work
from app.window.worker import Worker
from langflash_core.base.memory import give_back
from langflash_core.base.resources import asset_path
from langflash_core.reconstruction.networks import Networks
from tests.app.window.test_worker import PATIENCE, wait_for

HEARD_SECONDS = 0.1  # it never waits for the job, only for its turn on a busy machine
STOPPED_SECONDS = 1.0  # from the cancel until the worker is free for the next job
KEPT_MB = 40  # that may stay: what allocators hold back, not the some hundred MB of a reconstruction
TRIES = 3  # what other programs take from this machine comes and goes; the best of these counts
PHOTOS = tuple(asset_path(f"photos/living_room_{side}.png") for side in ("left", "right"))
NETWORKS = Networks()  # as a session holds one


def resident_mb() -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024


def stages_of(worker: Worker) -> dict[str, float]:
    """When each stage of a whole reconstruction began, seconds from the first one; but for how far matching
    is, which is told by the clock and not in every run."""
    began: dict[str, float] = {}
    worker.submit(work.ReconstructPhotos(PHOTOS, networks=NETWORKS))
    end = time.monotonic() + PATIENCE
    while "done" not in began:
        assert time.monotonic() < end, began
        for stage in (r.stage for r in worker.poll() if isinstance(r, show.Progressed)):
            if not stage.startswith("weights: "):
                began.setdefault(stage, time.monotonic())
        time.sleep(0.002)
    wait_for(worker, show.SceneArrived)
    return began


@pytest.fixture(scope="module")
def rehearsed():
    """A worker that has made the scene once, so that weights are read, and its stages: name -> the
    middle of each, seconds after its beginning."""
    worker = Worker()
    stages_of(worker)  # the first one reads the weights
    began = stages_of(worker)
    times = list(began.values())
    lasted = (after - before for before, after in itertools.pairwise(times))
    yield worker, {stage: seconds / 2 for stage, seconds in zip(began, lasted, strict=False)}
    worker.stop()


def cancelled_in(worker: Worker, stage: str, wait: float) -> tuple[float, float, float]:
    """Cancel `wait` seconds into a stage.

    Returns:
        Seconds until the person hears of it, until the worker is free; and MB that stayed; infinite where it
        ended before.
    """
    gc.collect()
    give_back()
    before = resident_mb()
    worker.submit(work.ReconstructPhotos(PHOTOS, networks=NETWORKS))
    end = time.monotonic() + PATIENCE
    while not any(r.stage == stage for r in worker.poll() if isinstance(r, show.Progressed)):
        assert time.monotonic() < end, stage
        time.sleep(0.002)
    time.sleep(wait)
    start = time.monotonic()
    worker.cancel()
    ended = wait_for(worker, (show.JobCancelled, show.SceneArrived))
    heard = time.monotonic() - start
    if isinstance(ended[-1], show.SceneArrived):  # it was quicker than its rehearsal
        return math.inf, math.inf, math.inf
    worker.submit(work.LoadScene(Path("gone.langflash")))  # its turn comes when the job has ended
    wait_for(worker, show.JobFailed)
    return heard, time.monotonic() - start, resident_mb() - before


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="asks Linux for the memory held")
def test_cancel_in_any_stage_frees_the_worker_and_its_memory(rehearsed) -> None:
    worker, stages = rehearsed
    assert len(stages) >= 8  # photos, weights, the network's own, assemble, prune
    for stage, middle in stages.items():
        tries = []
        for _ in range(TRIES):
            tries.append(cancelled_in(worker, stage, middle))
            heard, free, kept = (min(values) for values in zip(*tries, strict=True))
            if heard < HEARD_SECONDS and free < STOPPED_SECONDS and kept < KEPT_MB:
                break
        sys.stdout.write(f"{stage:20s} heard {heard:.3f} s, free {free:.2f} s, kept {kept:+.0f} MB\n")
        assert heard < HEARD_SECONDS, (stage, tries)
        assert free < STOPPED_SECONDS and kept < KEPT_MB, (stage, tries)
