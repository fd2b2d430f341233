"""`langflash lab eval level`: how scenes stand, how large they are, what inventory and plan get right."""

from argparse import Namespace
from typing import TextIO

from ...report import ProgressBar, write_tables
from .held_out import held_out

ROOMS = 100


def level(args: Namespace, out: TextIO) -> None:
    """Judge held-out rooms.

    Raises:
        LangFlashError: the pack, the folder or the output cannot be used.
    """
    pack, seeds = held_out(args, ROOMS)
    from langflash_core.lab.evaluation.level import level_markdown, run_level

    with ProgressBar() as progress:
        result = run_level(
            pack, seeds, photos=args.photos, keep=args.keep, things=not args.no_things, progress=progress
        )
    write_tables(args, result, level_markdown(result), out)
