"""The first, second, third ... call of a kind fails, until nothing fails any more; after each: every file is
as it was or as it was to be, nothing is lost, and what went wrong is one sentence.

    python -m tests.torture calls [--seed 1] [--minutes 10] [--only export query ...]

A job runs in this process, once whole into an empty folder for what it is to make, once with other words for
what lies there before. Then it runs over and over, a later call failing each time: over what was there, or
(every other time) into an empty folder. Where a job has more calls than its share of the time allows, their
numbers are spread evenly, and the table says how many of how many were tried. The seed says in which order
the jobs come; those that no time is left for are said to be left out.
"""

import contextlib
import errno
import gc
import hashlib
import io
import json
import os
import random
import shutil
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from PIL import Image

from langflash_core.base.formats import kind_of
from langflash_core.base.outputs import READERS, import_reference
from langflash_core.base.resources import asset_path, shader_path
from langflash_core.errors import LangFlashError
from tests.torture.failing import Fault, failing, small_disk
from tests.torture.rows import Row

ERRORS = {
    "place": (errno.ENOSPC, errno.EROFS, errno.EXDEV, errno.ENOENT, errno.EACCES, errno.EIO),
    "write": (errno.ENOSPC, errno.EIO),
    "read": (errno.EIO, errno.ENOENT, errno.EMFILE),
}
FILES = ("place", "write", "read")
STEPS = 12  # sizes of a disk that is too small


@dataclass(frozen=True)
class Job:
    """What is done while something fails. run: with the folder of what is read ("in") and made ("out") in it;
    gives an exit code and what was said. old: the same with other words, to have something there before.
    kinds: of `failing.KINDS`, and "disk". same: whether two runs write the same bytes. fresh: whether it can
    begin with nothing in "out", as what makes something can, and what goes on with something cannot. keeps:
    begins the names of what stays although it failed, to go on from there."""

    name: str
    run: Callable[[Path], tuple[int, str]]
    old: Callable[[Path], tuple[int, str]]
    kinds: tuple[str, ...] = FILES
    same: bool = True
    fresh: bool = True
    keeps: str = "\0"


@dataclass
class Failed(Row):
    """Of a job and a kind. calls: of a whole run. tried: how many of them failed in turn; in `went` of them
    the work was done all the same."""

    calls: int = 0
    tried: int = 0
    went: int = 0

    def tell(self) -> "Failed":
        """In words."""
        self.told = f"{self.tried:,} of {self.calls:,} calls failed, {self.went:,} did no harm to the work"
        return self


def everything(jobs: Sequence[Job], folder: Path, seconds: float, seed: int = 1) -> Iterator[Failed]:
    """Rows of all jobs in an order of the seed's; the processor's `seconds` are shared among those to come,
    and a job that none are left for is said to be left out, for another seed."""
    end = processor() + seconds
    order = random.Random(seed).sample(jobs, len(jobs))
    for place, job in enumerate(order):
        left = end - processor()
        if left > 0:
            yield from torture(job, folder, left / (len(order) - place), seed)
        else:
            yield Failed(job.name, "left out")


def processor() -> float:
    """Seconds of the processor that this process and those it waited for have used."""
    return sum(os.times()[:4])


def torture(job: Job, folder: Path, seconds: float, seed: int = 1) -> Iterator[Failed]:
    """A row per kind; `seconds` for all of them."""
    out, new, old = folder / "out", folder / "new", folder / "old"
    for other, how in ((old, job.old), (new, job.run)):
        _lay(out, old if other is new and not job.fresh else None)
        code, said = _spoken(how, folder)
        assert code == 0, (job.name, said)
        shutil.rmtree(other, ignore_errors=True)
        shutil.copytree(out, other)
    share = seconds / len(job.kinds)
    for kind in job.kinds:
        row = Failed(f"{job.name}: {kind}")
        began = processor()
        for nth in _numbers(job, folder, kind, row, share, seed):
            empty = job.fresh and (nth + seed) % 2 == 0
            _lay(out, None if empty else old)
            _try(job, folder, kind, nth, row, {} if empty else _digests(old), _digests(new))
            if processor() - began > 3 * share:
                break
        gc.collect()
        yield row.tell()


def _numbers(job: Job, folder: Path, kind: str, row: Failed, share: float, seed: int) -> list[int]:
    """Which calls fail: all, or as many as there is time for, spread evenly."""
    if kind == "disk":
        row.calls = STEPS
        return list(range(STEPS))
    _lay(folder / "out", folder / "old")
    began = processor()
    with _fault(kind, 10**9, folder) as fault:
        _spoken(job.run, folder)
    assert fault is not None
    each = (processor() - began) * 0.6 + 0.002  # the later a call, the longer until it fails
    row.calls = fault.calls
    wanted = row.calls * (len(ERRORS.get(kind, ())) or 1)
    most = max(4, int(share / each))
    if wanted <= most:
        return list(range(1, wanted + 1))
    return sorted({1 + (place * wanted // most + seed) % wanted for place in range(most)})


def _fault(kind: str, nth: int, folder: Path) -> contextlib.AbstractContextManager[Fault | None]:
    """nth: with more errors than one of a kind, each call fails in each way."""
    errors = ERRORS.get(kind, (errno.ENOMEM,))
    places = (folder,) if kind != "read" else (folder, asset_path(""), shader_path(""))
    return failing(kind, (nth - 1) // len(errors) + 1, places, errors[(nth - 1) % len(errors)])


def _try(job: Job, folder: Path, kind: str, nth: int, row: Failed, before: dict, new: dict) -> None:
    row.tried += 1
    if kind == "disk":
        sizes = [path.stat().st_size for path in (folder / "new").rglob("*") if path.is_file()]
        scope = small_disk(max(sizes, default=1) * nth // STEPS)
    else:
        scope = _fault(kind, nth, folder)
    with scope as given:
        fault = given or Fault(kind, nth, (), 0)
        try:
            code, said = _spoken(job.run, folder)
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            code, said = -1, "".join(traceback.format_exception(error))
    failed = fault.failed.split()[0] if fault.failed else ""
    wrong = _wrong(code, said) or _harm(job, folder / "out", before, new, code, failed)
    row.went += code == 0
    if wrong:
        row.find(f"{wrong} [{fault.failed or nth}]")


def _wrong(code: int, said: str) -> str:
    """What is wrong with how it ended; "" for nothing."""
    # Many sets or clips are told one by one.
    errors = [line for line in said.splitlines() if line.startswith("langflash: ") or ": failed, " in line]
    if code == -1 or "Traceback" in said:
        return f"an exception: {said.strip().splitlines()[-1][:200]}"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if "a bug in LangFlash" in said or "unexpected" in said:
        return f"called a bug: {said.strip().splitlines()[-1][:200]}"
    if code and len(errors) != 1:
        return f"{len(errors)} sentences for one failure: {said[:200]!r}"
    return ""


def _harm(job: Job, out: Path, before: dict[str, str], new: dict[str, str], code: int, failed: str) -> str:
    """What is wrong with the files; "" for nothing."""
    after = _digests(out)
    parts = [name for name in after if ".part" in name]
    if parts and failed not in ("os.remove", "os.rmdir", "os.scandir", "os.listdir"):
        return f"left behind: {parts[0]}"
    for name in before.keys() - after.keys():
        return f"lost: {name}"
    for name, digest in after.items():
        if name in parts or name.startswith(job.keeps) or name.endswith(".lock"):  # a lock has no content
            continue
        if not name.endswith(".part") and digest not in (before.get(name), new.get(name)):
            if name not in new and name not in before:
                return f"made beside what was asked: {name}"
            if job.same and code:
                return f"neither old nor new: {name}"
            problem = sound(out / name)
            if problem:
                return f"not whole: {name}: {problem}"
    missing = new.keys() - after.keys()
    return f"said to be done, and missing: {sorted(missing)[0]}" if code == 0 and missing else ""


def sound(path: Path) -> str:
    """What is wrong with a file by itself; "" where it opens."""
    try:
        if path.suffix in (".png", ".jpg", ".webp"):
            with Image.open(path) as picture:
                for place in range(getattr(picture, "n_frames", 1)):
                    picture.seek(place)
                    picture.load()
        elif path.suffix in (".json", ".edits"):
            json.loads(path.read_bytes())
        elif path.suffix == ".mp4":
            frames, _ = imageio_ffmpeg.count_frames_and_secs(str(path))
            assert frames == 9, f"{frames} frames of 9"
        elif path.suffix == ".npz":
            with np.load(path) as stored:
                _ = [stored[name] for name in stored.files]
        elif kind_of(path) in READERS:
            import_reference(READERS[kind_of(path)])(path)
        elif not path.stat().st_size:
            return "empty"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return ""


def _lay(out: Path, old: Path | None) -> None:
    shutil.rmtree(out, ignore_errors=True)
    if old is None:
        out.mkdir(parents=True)
    else:
        shutil.copytree(old, out)


def _digests(folder: Path) -> dict[str, str]:
    paths = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in paths}


def _spoken(run: Callable[[Path], tuple[int, str]], folder: Path) -> tuple[int, str]:
    """Exit code, and all that went to stderr or was said otherwise."""
    errors, out = io.StringIO(), io.StringIO()
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(out):
        try:
            code, said = run(folder)
        except LangFlashError as error:
            code, said = error.exit_code, f"langflash: {error}"
    return code, errors.getvalue() + said
