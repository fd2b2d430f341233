"""`main`: parse, run one command, turn every failure into one sentence and an exit code."""

import contextlib
import gc
import importlib
import os
import signal
import sys
from collections.abc import Sequence

from langflash_core.base.optional import optional_packages
from langflash_core.errors import LangFlashError

from .overview import LAB, first_day
from .parser import build_parser
from .report import INTERRUPTED, explained, say_error

# Imports make a million objects that stay; looking for garbage among them, as Python would do
# every 700 of them, is a tenth of the time that torch takes.
_COLLECT_EVERY = (50_000, 20, 20)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: the words after `langflash`; `sys.argv[1:]` when None.

    Returns:
        0 done; 1 it failed; 2 bad input; 130 stopped by Ctrl-C.
    """
    gc.set_threshold(*_COLLECT_EVERY)
    try:
        return _run(argv)
    except LangFlashError as error:
        say_error(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        say_error("stopped; nothing was written")
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of a pipe (`| head`) went away: not an error. Python would complain once
        # more when it flushes at exit, so stdout now leads nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        say_error(explained(error))
        return 1


def _run(argv: Sequence[str] | None) -> int:
    try:
        words = list(sys.argv[1:] if argv is None else argv)
        if not words:
            print(first_day())
            return 0
        args = build_parser(words[0]).parse_args(words)
    except SystemExit as done:  # --help and --version
        return int(done.code or 0)
    if os.environ.get("LANGFLASH_PROGRESS"):
        # Another program runs this one and stops it by Ctrl-C's signal. A shell starts what it runs in the
        # background with that signal ignored, and every child inherits it.
        with contextlib.suppress(ValueError):  # not the main thread
            signal.signal(signal.SIGINT, signal.default_int_handler)
    with optional_packages():
        folder = "lab" if args.command in LAB else "commands"
        command = importlib.import_module(f".{folder}.{args.command.replace('-', '_')}", __package__)
        if not getattr(args, "json", False):
            return command.run(args, sys.stdout) or 0
        # stdout carries one document and nothing else, whatever a library prints.
        document_stream = sys.stdout
        with contextlib.redirect_stdout(sys.stderr):
            return command.run(args, document_stream) or 0
