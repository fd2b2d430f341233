"""A run over many items by two workers, of which one is killed with -9, against the run by one.

    python -m tests.tools.rehearsal FOLDER [--address local] [--sets 40] [--size 84]
    python -m tests.batch.moving_clips CLIPS 8
    python -m tests.tools.rehearsal FOLDER --command labels CLIPS --same labels.safetensors

Says whether the results are the same, whether anything was done twice, and what failed. With a command of its
own any that keeps a `ledger.csv` can be rehearsed so; what is compared is the file `--same` of every item:
all tensors of it where it holds tensors, else its bytes. Everybody has one thread, since sums are rounded
otherwise by several.
"""

import argparse
import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import torch
from safetensors.torch import load_file

from tests.batch.photo_sets import make_sets

_CALM = 0.2  # seconds between looks at a run
_MARKS = (b"spawn_main", b"ray::_Server")  # what workers are called among processes


def rows_of(output: Path) -> dict[str, dict[str, str]]:
    """The ledger by name; {} as long as there is none."""
    try:
        with (output / "ledger.csv").open(newline="") as stream:
            return {row["name"]: row for row in csv.DictReader(stream)}
    except FileNotFoundError:
        return {}


def workers_of(run: int) -> list[int]:
    """Numbers of the worker processes below a process, oldest first (Linux)."""
    parents = {}
    for place in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(place.name)] = int((place / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    below = {run}
    for _ in parents:
        more = {child for child, parent in parents.items() if parent in below} - below
        if not more:
            break
        below |= more
    return sorted(number for number in below - {run} if _is_worker(number))


def _is_worker(number: int) -> bool:
    try:
        words = Path(f"/proc/{number}/cmdline").read_bytes()
    except OSError:
        return False
    return any(mark in words for mark in _MARKS)


def run_killed(command: Sequence[str], output: Path, after: int) -> int:
    """Run a command, and kill one of its workers once so many items are noted; its exit code."""
    run, killed = subprocess.Popen(command, stdout=subprocess.DEVNULL), 0
    while run.poll() is None:
        time.sleep(_CALM)
        if not killed and len(rows_of(output)) >= after and (workers := workers_of(run.pid)):
            killed = workers[-1]
            os.kill(killed, signal.SIGKILL)
    assert killed, "no worker was found to kill"
    return run.returncode


def same_tensors(one: Path, other: Path) -> bool:
    """Whether two files hold the same numbers; their headers tell times."""
    left, right = load_file(one), load_file(other)
    return left.keys() == right.keys() and all(torch.equal(left[k], right[k]) for k in left)


def same_bytes(one: Path, other: Path) -> bool:
    return one.read_bytes() == other.read_bytes()


def compared(alone: Path, output: Path, name: str, same: Callable[[Path, Path], bool]) -> dict:
    """What differs between two runs' outputs."""
    expected, found = rows_of(alone), rows_of(output)
    done = [item for item, row in expected.items() if row["status"] == "done"]
    return {
        "items": len(expected),
        "done": sum(row["status"] == "done" for row in found.values()),
        "failed": {item: row["reason"] for item, row in found.items() if row["status"] != "done"},
        "begun again": [item for item, row in found.items() if row["retried"] != "0"],
        "other statuses": [i for i in expected if found.get(i, {}).get("status") != expected[i]["status"]],
        "other results": [i for i in done if not same(alone / i / name, output / i / name)],
        "left behind": sorted(p.name for p in output.iterdir() if p.is_dir() and p.name not in found),
    }


def spoil(sets: Path) -> None:
    """Two more sets that nobody can use, among the others."""
    (sets / "set0003_empty").mkdir()
    (sets / "set0007_words").mkdir()
    (sets / "set0007_words" / "a.jpg").write_text("these are words")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--address")
    parser.add_argument("--sets", type=int, default=40)
    parser.add_argument("--size", default="84")
    parser.add_argument("--command", nargs="+", help="instead of batch: a command and its arguments")
    parser.add_argument("--same", default="scene.langflash", help="the file of an item that is compared")
    args = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    sets = args.folder / "sets"
    if args.command is None:
        make_sets(sets, args.sets)
        spoil(sets)
    command = args.command or ["batch", str(sets), "--size", args.size]
    langflash = [sys.executable, "-m", "langflash_core", *command]
    alone, output = args.folder / "alone", args.folder / "out"
    subprocess.run([*langflash, "-o", str(alone), "--workers", "1"], stdout=subprocess.DEVNULL)
    cluster = [] if args.address is None else ["--address", args.address]
    two = [*langflash, "-o", str(output), "--workers", "2", *cluster]
    code = run_killed(two, output, after=max(1, len(rows_of(alone)) // 4))
    same = same_tensors if args.same.endswith((".langflash", ".safetensors")) else same_bytes
    document = {"exit code": code, **compared(alone, output, args.same, same)}
    before = {item: (output / item / args.same).stat().st_mtime_ns for item in rows_of(alone)
              if (output / item / args.same).is_file()}  # fmt: skip
    subprocess.run(two, stdout=subprocess.DEVNULL)
    after = {item: (output / item / args.same).stat().st_mtime_ns for item in before}
    document["done twice"] = [item for item in before if before[item] != after[item]]
    sys.stdout.write(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
