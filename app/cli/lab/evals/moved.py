"""`langflash eval moved`: what is found of things that were moved between two scenes of a room."""

from argparse import Namespace
from typing import TextIO

from langflash_core.errors import InputError
from langflash_core.files import check_folder, check_output_file, readable_file
from langflash_core.lab.rooms import load_pack
from langflash_core.lab.training.cache import HELD_OUT_SEED

from ...renderers import open_renderer
from ...report import ProgressBar, write_tables

ROOMS = 10


def moved(args: Namespace, out: TextIO) -> None:
    """Judge held-out rooms.

    Raises:
        LangFlashError: the pack, the folder or the output cannot be used.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.keep is not None:
        check_folder(args.keep)
    pack = load_pack(readable_file(args.pack, "furniture pack", InputError))
    from langflash_core.lab.evaluation.moved import moved_markdown, run_moved

    first = HELD_OUT_SEED if args.first_seed is None else args.first_seed
    seeds = range(first, first + (args.limit or ROOMS))
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        result = run_moved(pack, seeds, renderer, keep=args.keep, progress=progress)
    write_tables(args, result, moved_markdown(result), out)
