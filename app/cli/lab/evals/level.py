"""`langflash eval level`: how scenes stand, how large they are, what inventory and plan get right."""

from argparse import Namespace
from typing import TextIO

from langflash_core.errors import InputError
from langflash_core.files import check_folder, check_output_file, readable_file
from langflash_core.lab.rooms import load_pack
from langflash_core.lab.training.cache import HELD_OUT_SEED

from ...report import ProgressBar, write_tables

ROOMS = 100


def level(args: Namespace, out: TextIO) -> None:
    """Judge held-out rooms.

    Raises:
        LangFlashError: the pack, the folder or the output cannot be used.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.keep is not None:
        check_folder(args.keep)
    pack = load_pack(readable_file(args.pack, "furniture pack", InputError))
    from langflash_core.lab.evaluation.level import level_markdown, run_level

    first = HELD_OUT_SEED if args.first_seed is None else args.first_seed
    with ProgressBar() as progress:
        result = run_level(
            pack,
            range(first, first + (args.limit or ROOMS)),
            photos=args.photos,
            keep=args.keep,
            things=not args.no_things,
            progress=progress,
        )
    write_tables(args, result, level_markdown(result), out)
