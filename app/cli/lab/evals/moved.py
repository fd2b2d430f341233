"""`langflash lab eval moved`: what is found of things that were moved between two scenes of a room."""

from argparse import Namespace
from typing import TextIO

from ...renderers import open_renderer
from ...report import ProgressBar, write_tables
from .held_out import held_out

ROOMS = 10


def moved(args: Namespace, out: TextIO) -> None:
    """Judge held-out rooms.

    Raises:
        LangFlashError: the pack, the folder or the output cannot be used.
    """
    pack, seeds = held_out(args, ROOMS)
    from langflash_core.lab.evaluation.moved import moved_markdown, run_moved

    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        result = run_moved(pack, seeds, renderer, keep=args.keep, progress=progress)
    write_tables(args, result, moved_markdown(result), out)
