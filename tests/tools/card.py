"""Every figure that a graphics card has, in one command; without a card the rest, on the processor.

    python -m tests.tools.card -o FOLDER --build    # once: compiles gsplat's CUDA code, minutes
    python -m tests.tools.card -o FOLDER [--quick] [--only STEP ...]

Each step runs in a process of its own with a time limit, so that one failure costs nothing else. Writes
FOLDER/card.json and, to be read, "card.md" beside it after every step.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from . import card_steps

GOALS = {"network-full": "full <= 10 ms for two 256 x 256 views", "asking": "32 phrases <= 1 ms",
         "pictures": ">= 500 moving frames a second"}  # fmt: skip
_MEMBER = "tests.tools.card"


@dataclass(frozen=True)
class Step:
    """A process: its name, its arguments after the interpreter, its limit in seconds, what it writes."""

    name: str
    command: tuple[str, ...]
    seconds: int
    written: Path


def steps(folder: Path, quick: bool, card: bool) -> list[Step]:
    """What is measured, in order; without a card the card's own are left out."""
    made = [_own(name, folder, quick) for name in (["ceilings", "asking"] if card else ["asking"])]
    networks = [("full", 256), ("mini", 224)] if card or not quick else [("mini", 224)]
    for compiled in (False, True) if card else (False,):
        made += [_network(preset, side, folder, quick, card, compiled) for preset, side in networks]
    made.append(_own("pictures", folder, quick))
    return [*made, *([_own("gsplat", folder, quick)] if card else [])]  # last: its build may still run


def _own(name: str, folder: Path, quick: bool) -> Step:
    size = ("--quick",) if quick else ()
    command = ("-m", _MEMBER, "-o", str(folder), "--step", name, *size)
    return Step(name, command, 240 if name == "gsplat" else 120, folder / f"{name}.json")


def _network(preset: str, side: int, folder: Path, quick: bool, card: bool, compiled: bool) -> Step:
    name = f"network-{preset}" + ("-compiled" if compiled else "")
    written = folder / f"{name}.json"
    command = (
        "-m", "langflash_core", "lab", "bench-network", "--preset", preset, "--random", "--device",
        "cuda" if card else "cpu", "--size", str(side), "--views", "2", "--repeats", "1" if quick else "20",
        "-o", str(written), *(("--compile",) if compiled else ()), *(() if card else ("--float32",)),
    )  # fmt: skip
    return Step(name, command, 120, written)


def run_step(step: Step) -> dict:
    """What the step wrote, or why it wrote nothing; its seconds."""
    step.written.unlink(missing_ok=True)
    start = time.perf_counter()
    process = subprocess.Popen(
        (sys.executable, *step.command),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        out, err = process.communicate(timeout=step.seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)  # compilers it started, too: they hold the pipes
        process.communicate()
        if not step.written.exists():
            return {"failed": f"longer than {step.seconds} s", "took_s": step.seconds}
        cut = {"cut": f"ended after {step.seconds} s; these rows were done"}
        return {**json.loads(step.written.read_text(encoding="utf-8")), **cut, "took_s": step.seconds}
    took = round(time.perf_counter() - start, 1)
    if process.returncode or not step.written.exists():
        said = (err or out).strip()[-2000:]
        return {"failed": f"status {process.returncode}: {said}", "took_s": took}
    return {**json.loads(step.written.read_text(encoding="utf-8")), "took_s": took}


def document_text(document: dict) -> str:
    """The page: the machine, then a table for each step."""
    lines = [
        "# Measured on this machine",
        "",
        *(f"- {key}: {value}" for key, value in document["machine"].items()),
    ]
    if document["left_out"]:
        lines += ["", document["left_out"]]
    for name, found in document["steps"].items():
        goal = GOALS.get(name.removesuffix("-compiled"))
        lines += ["", f"## {name} ({found['took_s']:g} s)", "", *([f"Goal: {goal}.", ""] if goal else [])]
        lines += _table(found)
    return "\n".join(lines) + "\n"


def _table(found: dict) -> list[str]:
    if "failed" in found:
        return [f"Failed: {found['failed']}"]
    notes = [f"{key}: {value}" for key, value in found.items() if key not in ("rows", "took_s")]
    rows = found.get("rows", [])
    if not rows:
        return notes
    columns = list(dict.fromkeys(key for row in rows for key in row))
    lines = ["; ".join(notes), "", "| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    return lines + ["| " + " | ".join(_shown(row.get(name)) for name in columns) + " |" for row in rows]


def _shown(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def measure(folder: Path, quick: bool, only: list[str] | None) -> None:
    """All steps, or some; both files are written anew after each."""
    machine, card = card_steps.machine()
    left_out = (
        "" if card else "There is no CUDA card: its ceilings, gsplat and compiled networks are left out."
    )
    document: dict = {"machine": machine, "left_out": left_out, "steps": {}}
    for step in steps(folder, quick, card):
        if only is not None and step.name not in only:
            continue
        document["steps"][step.name] = run_step(step)
        text = document_text(document)
        (folder / "card.json").write_text(json.dumps(document, indent=1), encoding="utf-8")
        (folder / "card.md").write_text(text, encoding="utf-8")
        sys.stdout.write(f"{step.name}: {document['steps'][step.name].get('failed', 'done')}\n")
        sys.stdout.flush()
    sys.stdout.write(document_text(document))


def main() -> None:
    """Build, measure, or be one step of it."""
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--quick", action="store_true", help="small: a rehearsal")
    parser.add_argument("--build", action="store_true", help="compile gsplat's CUDA code and nothing else")
    parser.add_argument(
        "--only", nargs="+", metavar="STEP", help="such as network-full; all others are left out"
    )
    parser.add_argument("--step", choices=sorted(card_steps.STEPS), help=argparse.SUPPRESS)
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("MAX_JOBS", str(max(1, (os.cpu_count() or 2) - 2)))
    if args.build:
        if shutil.which("nvcc") is None:
            raise SystemExit("nvcc is not on the PATH, so gsplat's CUDA code cannot be compiled")
        card_steps.build()
    elif args.step:
        found = card_steps.STEPS[args.step](args.output, args.quick)
        (args.output / f"{args.step}.json").write_text(json.dumps(found), encoding="utf-8")
    else:
        measure(args.output, args.quick, args.only)


if __name__ == "__main__":
    main()
