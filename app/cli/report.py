"""What a command says: one sentence for an error, warnings, one JSON document, a progress bar."""

import json
import os
import shutil
import sys
import time
from argparse import Namespace
from collections.abc import Iterable
from typing import Any, TextIO

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.memory import out_of_memory
from langflash_core.base.running import time_left
from langflash_core.errors import LangFlashError

INTERRUPTED = 130
"""What a shell reports for a program that Ctrl-C ended: 128 and the signal's number."""


def one_sentence(text: str) -> str:
    """`text` on one line, whatever line breaks it came with."""
    return " ".join(text.split())


def explained(error: Exception) -> str:
    """An error as one sentence with a remedy; where it is a bug, LANGFLASH_DEBUG in the environment prints
    its way there."""
    if isinstance(error, LangFlashError):
        return one_sentence(str(error))
    if isinstance(error, OSError):
        return f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
    if out_of_memory(error):
        return "out of memory; close other programs, or try a smaller --size, fewer photos or fewer Gaussians"
    if os.environ.get("LANGFLASH_DEBUG"):
        import traceback

        traceback.print_exception(error)
    return (
        f"a bug in LangFlash, {type(error).__name__}: {error}; "
        "run again with LANGFLASH_DEBUG=1 in the environment and report what it prints"
    )


def say_error(text: str) -> None:
    """`langflash: <sentence>` on stderr."""
    print(f"langflash: {one_sentence(text)}", file=sys.stderr)


def say_warnings(warnings: Iterable[str]) -> None:
    """`warning: <sentence>` on stderr, one line each."""
    for warning in warnings:
        print(f"warning: {one_sentence(warning)}", file=sys.stderr)


def write_json(document: dict[str, Any], stream: TextIO) -> None:
    """One JSON document, ASCII (any terminal encoding carries it).

    Raises:
        ValueError: a number is not finite, which JSON cannot hold.
    """
    json.dump(document, stream, indent=2, allow_nan=False)
    stream.write("\n")
    stream.flush()


def tell(args: Namespace, document: dict[str, Any], lines: Iterable[str], out: TextIO) -> None:
    """With --json the document, else the lines for people."""
    if args.json:
        return write_json(document, out)
    for line in lines:
        print(line, file=out)


class ProgressBar:
    """A bar on stderr where stderr is a terminal, silence otherwise.

    With `LANGFLASH_PROGRESS=lines` in the environment it writes a line of `progress`, the fraction
    and the stage, separated by tabs, for another program to read.

    Call it with a stage's name and the fraction in [0, 1] that is done; as a context manager
    it leaves a clean line behind, also after an error.
    """

    WIDTH = 30

    def __init__(self, stream: TextIO | None = None):
        self.stream = sys.stderr if stream is None else stream
        self.lines = os.environ.get("LANGFLASH_PROGRESS") == "lines"
        self.live = self.stream.isatty() and not self.lines
        self.start = time.monotonic()
        self.drawn = 0  # characters on the line now

    def __call__(self, stage: str, fraction: float) -> None:
        if self.lines:
            self.stream.write(f"progress\t{fraction:.4f}\t{stage}\n")
            self.stream.flush()
        if not self.live:
            return
        done = round(self.WIDTH * min(max(fraction, 0.0), 1.0))
        bar = "#" * done + "." * (self.WIDTH - done)
        seconds = time.monotonic() - self.start
        rest = time_left(seconds, fraction)
        line = f"[{bar}] {seconds:5.1f} s  {stage}{', ' if rest else ''}{rest}"
        line = line[: shutil.get_terminal_size().columns - 1]  # a second line could not be wiped
        self.stream.write("\r" + line.ljust(self.drawn))
        self.stream.flush()
        self.drawn = len(line)

    def say(self, line: str) -> None:
        """A line of its own, which stays above the bar."""
        self._wipe()
        self.stream.write(f"{line}\n")
        self.stream.flush()

    def __enter__(self) -> "ProgressBar":
        return self

    def __exit__(self, *_: object) -> None:
        self._wipe()

    def _wipe(self) -> None:
        if self.live and self.drawn:
            self.stream.write("\r" + " " * self.drawn + "\r")
            self.stream.flush()
            self.drawn = 0


def write_tables(args: Namespace, result: dict, table: str, out: TextIO) -> None:
    """The tables to the file of -o, where one is named, and they or, with --json, the result to `out`."""
    if args.output is not None:
        make_folder(args.output.parent)
        write_atomically(args.output, table.encode())
    if args.json:
        write_json(result, out)
    else:
        print(table, end="", file=out)
