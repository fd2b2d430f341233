"""What a run over many sets saves: one worker of `langflash batch` against a `reconstruct` process a set.

    python -m tests.tools.throughput FOLDER --sets 1000 --alone 20 --size 84

Processor seconds of both, whose ratio other programs on the machine hardly touch, and seconds by the clock.
Set OMP_NUM_THREADS=1, so that both have one thread.
"""

import argparse
import csv
import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.batch.photo_sets import make_sets

LANGFLASH = (sys.executable, "-m", "langflash_core")


@dataclass(frozen=True)
class Spent:
    """A command's seconds: of processors, with all its children, and by the clock."""

    processor: float
    clock: float


def spent(command: Sequence[str]) -> Spent:
    """Run a command to its end; it must succeed."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    clock = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Spent(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, clock)


def main() -> None:
    """Make sets, do half of the lone ones, all in one run, the other half; print and keep the figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--sets", type=int, default=1000)
    parser.add_argument("--alone", type=int, default=20)
    parser.add_argument("--size", type=int, default=84)
    args = parser.parse_args()
    size = ("--size", str(args.size))
    sets = make_sets(args.folder / "sets", args.sets)
    chosen = sets[:: max(1, args.sets // args.alone)][: args.alone]

    def lone(places: Sequence[Path]) -> list[Spent]:
        scene = args.folder / "alone.langflash"
        return [
            spent((*LANGFLASH, "reconstruct", *map(str, sorted(place.iterdir())), "-o", str(scene), *size))
            for place in places
        ]

    alone = lone(chosen[::2])
    output = args.folder / "out"
    together = spent((*LANGFLASH, "batch", str(sets[0].parent), "-o", str(output), "--workers", "1", *size))
    alone += lone(chosen[1::2])
    with (output / "ledger.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    memory = [int(row["memory_mb"]) for row in rows]
    each = Spent(together.processor / args.sets, together.clock / args.sets)
    mean = Spent(*(sum(getattr(s, k) for s in alone) / len(alone) for k in ("processor", "clock")))
    document = {
        "sets": args.sets,
        "rows": len(rows),
        "done": sum(row["status"] == "done" for row in rows),
        "alone": asdict(mean),
        "together": asdict(each),
        "ratio": {"processor": mean.processor / each.processor, "clock": mean.clock / each.clock},
        "memory_mb": {str(k): memory[k] for k in (0, 9, 99, 199, 499, args.sets - 1) if k < len(memory)},
    }
    (args.folder / "throughput.json").write_text(json.dumps(document, indent=2))
    sys.stdout.write(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
