"""`langflash lab eval beside`: two results of walk, or of sides, case by case."""

from argparse import Namespace
from typing import TextIO

from langflash_core.errors import InputError
from langflash_core.lab.evaluation import side_tables, walk_tables

from . import sides, walk
from .results import check_files

JUDGEMENTS = (
    (sides.RESULTS, side_tables.beside_markdown),
    (walk.RESULTS, walk_tables.beside_markdown),
)


def beside(args: Namespace, out: TextIO) -> None:
    """Two results of the same cases in one table.

    Raises:
        InputError: a folder holds no results, or they have no case in common.
    """
    check_files(args)
    for results, markdown in JUDGEMENTS:
        if (args.before / results.file).is_file():
            return results.beside(args, markdown, out)
    raise InputError(f"{args.before} holds no result of eval sides or walk; make it with --results")
