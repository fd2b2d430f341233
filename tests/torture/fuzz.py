"""Hostile files for every reader of ours, guided by what of the readers they reach.

    python -m tests.torture.fuzz [--seed 1] [--count 10000] [--reader ply ...] [--keep FOLDER]

A file that takes a step through our code that no file before took joins those that are damaged further. A
find is whatever is not a whole result or one sentence: an exception, a message of several lines, ten seconds,
a gigabyte. Finds are made smaller and written into `tests/torture/finds/`, where `test_torture.py` reads
them.

A seed repeats a run where Python's hashes do too: set PYTHONHASHSEED for that.
"""

import argparse
import hashlib
import os
import resource
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from langflash_core.errors import InputError
from tests.torture.coverage import OURS, steps_of
from tests.torture.readers import Reader, prepare
from tests.torture.shapes import damaged

FINDS = Path(__file__).with_name("finds")
QUICK = Path("/dev/shm")  # where writing a file takes a hundredth of the time that a disk takes
SECONDS = 10
MEMORY = 2**30  # bytes that reading one of these files of some 10 kB may take beside what the program holds
KINDS = {  # of finds: how their words begin; all others are crashes
    f"over {SECONDS} s": "Slow ",
    f"over {MEMORY >> 30} GB": "MemoryError ",
    "bad sentences": "a bad sentence ",
}
_MOST_KEPT = 400  # files of a reader that are damaged further
_TRIES = 300  # to make a find smaller


class Slow(BaseException):
    """A reader took too long; no reader can catch it by mistake."""


@dataclass
class Told:
    """Of one reader. steps: taken so far. kept: files that took new ones. finds: what is
    wrong, and the name and bytes of the file."""

    count: int = 0
    read: int = 0
    refused: int = 0
    longest: float = 0.0
    steps: set = field(default_factory=set)
    kept: list[bytes] = field(default_factory=list)
    finds: dict[str, tuple[str, bytes]] = field(default_factory=dict)


def fuzz(reader: Reader, files: dict[str, bytes], folder: Path, count: int, seed: int) -> Told:
    """`count` damaged files of one reader."""
    rng = np.random.default_rng([seed, *reader.name.encode()])
    told, others = Told(), list(files.values())
    pools = {name: [files[name]] for name in reader.files}
    for name in reader.files:
        assert _outcome(reader, folder / name, told) is None, f"{name} is whole"
    for _ in range(count):
        name = reader.files[rng.integers(0, len(reader.files))]
        pool = pools[name]
        # The newest are damaged most: they reach farthest.
        at = len(pool) - 1 - int(len(pool) * rng.random() ** 2)
        content = damaged(name, pool[at], others[rng.integers(0, len(others))], rng)[: 1 << 20]
        path, before = folder / name, len(told.steps)
        path.write_bytes(content)
        found = _outcome(reader, path, told)
        if found is not None and found not in told.finds:
            told.finds[found] = name, _smaller(content, found, reader, path)
        elif len(told.steps) > before and found is None:
            pool.append(content)
            del pool[1 : max(1, len(pool) - _MOST_KEPT)]
        path.write_bytes(files[name])  # other readers may look at it
    told.kept = [content for pool in pools.values() for content in pool]
    return told


def _outcome(reader: Reader, path: Path, told: Told) -> str | None:
    """None, or what is wrong: the same words for the same fault."""
    started = time.perf_counter()
    with _alarm():
        steps, error = steps_of(lambda: reader.read(path))
    told.longest = max(told.longest, time.perf_counter() - started)
    told.count += 1
    told.steps |= steps
    if error is None:
        told.read += 1
        return None
    if isinstance(error, KeyboardInterrupt):
        raise error
    if not isinstance(error, InputError):
        return f"{type(error).__name__} in {_place(error)}"
    told.refused += 1
    sentence = str(error)
    whole = "\n" not in sentence and len(sentence) < 500 and ("; " in sentence or path.name in sentence)
    return None if whole else f"a bad sentence in {_place(error)}"


def _place(error: BaseException) -> str:
    """The innermost line of ours that raised it."""
    frames, here = [], error.__traceback__
    while here is not None:
        frames.append((here.tb_frame.f_code, here.tb_lineno))
        here = here.tb_next
    ours = [frame for frame in frames if frame[0].co_filename.startswith(OURS)]
    code, line = (ours or frames)[-1]
    return f"{Path(code.co_filename).name}:{code.co_name}:{line}"


@contextmanager
def _alarm():
    """Raises `Slow` in whatever runs, where the system has such a clock."""

    def ring(*_) -> None:
        raise Slow

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _smaller(content: bytes, found: str, reader: Reader, path: Path) -> bytes:
    """The same find with pieces left out, halves first."""
    best, size, tries = content, len(content) // 2, 0
    while size >= 1 and tries < _TRIES:
        start, shrunk = 0, False
        while start < len(best) and tries < _TRIES:
            tries += 1
            shorter = best[:start] + best[start + size :]
            path.write_bytes(shorter)
            if _outcome(reader, path, Told()) == found:
                best, shrunk = shorter, True
            else:
                start += size
        size = size if shrunk else size // 2
    return best


def keep_find(reader: Reader, name: str, content: bytes, folder: Path) -> Path:
    """Write a find where the tests look for it: READER~DIGEST~NAME."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{reader.name}~{hashlib.sha256(content).hexdigest()[:10]}~{name}"
    path.write_bytes(content)
    return path


def bounded(call: Callable[[], int]) -> int:
    """Run with no more memory than `MEMORY` above what is held now."""
    held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    kind = resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS
    before = resource.getrlimit(kind)
    size = int(Path("/proc/self/statm").read_text().split()[5]) * 4096 if sys.platform == "linux" else held
    resource.setrlimit(kind, (size + MEMORY, before[1]))
    try:
        return call()
    finally:
        resource.setrlimit(kind, before)


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--count", type=int, default=10_000, help="files in all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reader", action="append", help="this reader alone; may be given again")
    parser.add_argument("--keep", type=Path, default=FINDS, help="folder of finds")
    args = parser.parse_args(words)
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory(dir=QUICK if os.access(QUICK, os.W_OK) else None) as folder:
        files, readers = prepare(Path(folder))
        chosen = [one for one in readers if args.reader is None or one.name in args.reader]
        if not chosen:
            parser.error(f"no such reader; there are {', '.join(one.name for one in readers)}")
        return bounded(lambda: _all(chosen, files, Path(folder), args))


def kind_of(found: str) -> str:
    """Which of `KINDS` a find's words name; whatever has no name of its own is a crash."""
    return next((kind for kind, begins in KINDS.items() if found.startswith(begins)), "crashes")


def _all(chosen: list[Reader], files: dict[str, bytes], folder: Path, args: argparse.Namespace) -> int:
    finds, started = dict.fromkeys(("crashes", *KINDS), 0), time.process_time()
    count, longest, say = 0, 0.0, sys.stdout.write
    names = ("files", "read", "refused", "steps", "kept", "a file", "longest", "finds")
    say(f"{'reader':12}" + "".join(f"{name:>9}" for name in names) + "\n")
    for reader in chosen:
        began = time.process_time()
        told = fuzz(reader, files, folder, -(-args.count // len(chosen)), args.seed)
        numbers = (told.count, told.read, told.refused, len(told.steps), len(told.kept))
        say(f"{reader.name:12}" + "".join(f"{number:9,}" for number in numbers))
        each = 1000 * (time.process_time() - began) / told.count
        say(f"{each:6.2f} ms{told.longest:7.2f} s{len(told.finds):9}\n")
        for words, (name, content) in told.finds.items():
            say(f"    {words}: {keep_find(reader, name, content, args.keep)}\n")
            finds[kind_of(words)] += 1
        sys.stdout.flush()
        count, longest = count + told.count, max(longest, told.longest)
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    say(f"{count:,} files: {', '.join(f'{number} {kind}' for kind, number in finds.items())}; ")
    say(f"the slowest {longest:.2f} s, the whole program at most {most} MB, ")
    say(f"{time.process_time() - started:.0f} s of processor time\n")
    return 1 if any(finds.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
