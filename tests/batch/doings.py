"""What workers do in tests instead of reconstructing; imported by processes of their own."""

import os
import signal
import time
from contextlib import contextmanager
from pathlib import Path

from langflash_core.base.files import filled_atomically
from langflash_core.batch.dispatch import Job, Made
from langflash_core.batch.run import SCENE


def trace(photo: Path) -> Path:
    """A file beside a set's folder that gets a line a try: the worker's number."""
    return photo.parent.parent / f"{photo.parent.name}.tries"


def tries(photo: Path) -> list[str]:
    """Numbers of the processes that tried a set."""
    return trace(photo).read_text().split() if trace(photo).exists() else []


@contextmanager
def open_copier():
    """Copies the first photo into the scene; the photo's content says what else happens."""
    yield copied


def copied(job: Job) -> Made:
    photo = job.photos[0]
    with trace(photo).open("a") as stream:
        stream.write(f"{os.getpid()}\n")
    what = photo.read_text()
    if what == "bad":
        return Made("it is no picture; take another", 0.1)
    if what == "slow":
        time.sleep(60)
    with filled_atomically(job.folder) as staging:
        (staging / SCENE).write_text(what)
        if what == "kill" or (what == "kill once" and len(tries(photo)) == 1):
            os.kill(os.getpid(), signal.SIGKILL)
    return Made(seconds=0.1, gaussians=7, groups=2, found="1/1", memory_mb=9, warnings=("a", "b, <i>"))
