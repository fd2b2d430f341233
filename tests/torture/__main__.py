"""Everything that LangFlash is to survive, by parts: `python -m tests.torture [PART ...] [--seed 1]`.

Parts: `PARTS`. Their defaults are such that `make torture` runs them all in less than half an hour on two
idle cores; what each takes stands in README.md beside this file, and a part says it when it ends. Several
parts run two at a time, each in a process of its own, and are told as they end.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from tests.torture.rows import Row, report


def files(args: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """Hostile files: `fuzz.py`."""
    from tests.torture import fuzz

    words = ["--seed", str(args.seed), "--count", str(args.files)]
    code = fuzz.main([*words, *(word for name in args.only or () for word in ("--reader", name))])
    yield Row("hostile files", "as above", ["as above"] * code)


def calls(args: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """The n-th call fails: `nth.py`."""
    from tests.torture.jobs import prepared
    from tests.torture.nth import everything

    jobs = [job for job in prepared(folder) if any(job.name.startswith(name) for name in args.only or [""])]
    return everything(jobs, folder, 60 * _minutes(args, CALLS_MINUTES), args.seed)


def kills(args: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """Killed at random moments: `kills.py`."""
    from tests.torture.kills import everything

    return everything(folder, args.count, args.seed)


def together(args: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """Two programs at once: `together.py`."""
    from tests.torture.together import everything

    return everything(folder, args.rounds, args.seed)


def photos(args: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """Photos that no scene is in, or that deceive: `hard_photos.py`."""
    from tests.torture.hard_photos import everything

    return everything(folder, args.only)


def window(args: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """The window while the driver and the disk refuse: `window.py`."""
    from tests.torture.jobs import prepared
    from tests.torture.window import opened, torture

    prepared(folder)
    (folder / "out").mkdir()
    with opened(folder / "in" / "s.langflash", folder / "out") as session:
        yield from torture(session, folder, 60 * _minutes(args, WINDOW_MINUTES), args.seed)


def load(args: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """Much at once, and often: `load.py`."""
    from tests.torture.load import everything

    return everything(folder, args.questions, args.only)


def address(args: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """Addresses of pages: `address.py`."""
    from tests.torture.address import everything

    return everything(folder, args.addresses, args.seed)


CALLS_MINUTES, WINDOW_MINUTES = 7, 3


def _minutes(args: argparse.Namespace, usual: float) -> float:
    return usual if args.minutes is None else args.minutes


PARTS = {  # the longest first, so that two at a time end together
    each.__name__: each for each in (calls, files, load, photos, kills, window, together, address)
}  # fmt: skip


def side_by_side(parts: Sequence[str], words: Sequence[str], at_once: int) -> int:
    """Run parts, some at a time; how many of them found something or died."""

    def run(part: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "tests.torture", part, *words]
        return subprocess.run(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    wrong = 0
    with ThreadPoolExecutor(at_once) as pool:
        for done in as_completed([pool.submit(run, part) for part in parts]):
            sys.stdout.write(done.result().stdout)
            wrong += done.result().returncode != 0
    sys.stdout.write(f"{wrong} of {len(parts)} parts with finds\n")
    return wrong


def _words(args: argparse.Namespace) -> list[str]:
    """Of a command line that says the same, but for the parts."""
    said = {name: value for name, value in vars(args).items() if name != "parts" and value is not None}
    return [
        word
        for name, value in said.items()
        for word in (f"--{name.replace('_', '-')}", *map(str, value if isinstance(value, list) else [value]))
    ]


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.torture", description=str(__doc__).splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(PARTS)} (default: all)")
    parser.add_argument("--seed", type=int, default=1)
    budgets = f"calls {CALLS_MINUTES}, window {WINDOW_MINUTES}"
    parser.add_argument("--minutes", type=float, help=f"of the processor, about (default: {budgets})")
    parser.add_argument("--files", type=int, default=300_000, help="hostile ones (default: 300,000)")
    parser.add_argument("--count", type=int, default=200, help="of kills while it writes (default: 200)")
    parser.add_argument("--rounds", type=int, default=20, help="of two programs at once (default: 20)")
    parser.add_argument("--questions", type=int, default=10_000, help="in a row (default: 10,000)")
    parser.add_argument("--addresses", type=int, default=1_000_000, help="of pages (default: a million)")
    parser.add_argument("--at-once", type=int, default=min(2, os.cpu_count() or 1), help="parts (default: 2)")
    parser.add_argument("--only", nargs="+", help="of a part's rows those whose names begin so")
    args = parser.parse_args()
    unknown = [name for name in args.parts if name not in PARTS]
    if unknown:
        parser.error(f"no part {unknown[0]}; there are {', '.join(PARTS)}")
    from tests.torture.nth import processor

    warnings.simplefilter("ignore")
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    if len(args.parts) != 1 and args.at_once > 1:
        return 1 if side_by_side(args.parts or [*PARTS], _words(args), args.at_once) else 0
    finds = 0
    for name in args.parts or PARTS:
        began, spent = time.monotonic(), processor()
        with tempfile.TemporaryDirectory() as folder:
            finds += report(PARTS[name](args, Path(folder)), sys.stdout.write)
        say = f"{name}: {processor() - spent:.0f} s of the processor in {time.monotonic() - began:.0f} s\n"
        sys.stdout.write(say)
        sys.stdout.flush()
    return 1 if finds else 0


if __name__ == "__main__":
    sys.exit(main())
