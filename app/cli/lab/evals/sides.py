"""`lab eval sides`: scenes seen from aside."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from langflash_core.base.files import check_folder, readable_file
from langflash_core.errors import InputError
from langflash_core.lab.rooms import RoomRenderer, load_pack

from ...renderers import open_renderer
from ...report import ProgressBar, write_tables
from ..photos import opened_folder
from ..shared import colour_only, opened_lpips
from .results import Results, check_files

ROOMS, PAIRS = 100, 40


RESULTS = Results(
    "sides",
    "sides.json",
    frozenset({"cases", "by_look"}),
    "scene in common; make both with the same rooms or pairs",
)


def sides(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint, and the code that runs it, by views from aside.

    Raises:
        LangFlashError: pack, folder, checkpoint or output cannot be used.
    """
    if (args.pack is None) == (args.folder is None):
        raise InputError("give either a furniture pack or a folder with --posed; not both, not none")
    if args.pack is not None and args.size is not None:
        raise InputError("rooms are drawn at the network's own size; leave --size out, or judge --posed")
    check_files(args)
    if args.results is not None:
        check_folder(args.results, "--results")
    from langflash_core.lab.evaluation.side_tables import sides_markdown
    from langflash_core.lab.evaluation.sides import run_sides

    lpips = opened_lpips(args.lpips)
    with _cases(args) as (cases, count), open_renderer(args.backend) as renderer, ProgressBar() as progress:
        result = run_sides(
            cases,
            count,
            colour_only(renderer),
            args.weights,
            preset=args.preset,
            size=args.size,
            lpips=lpips,
            progress=progress,
        )
    if args.results is not None:
        RESULTS.write(args.results, result)
    write_tables(args, result, sides_markdown(result), out)


@contextmanager
def _cases(args: Namespace) -> Iterator[tuple[Iterator, int]]:
    """What is judged, and how much of it."""
    from langflash_core.lab.evaluation.side_subjects import posed_cases, room_cases

    if args.folder is not None:
        from langflash_core.lab.evaluation.posed import APART, chosen_triples

        folder = opened_folder(args)
        if folder.poses is None:
            raise InputError(f"{args.folder} has no poses.txt; add it, or judge rooms")
        triples = chosen_triples(folder.ids, args.limit or PAIRS, args.apart or APART)
        yield posed_cases(folder, triples), len(triples)
        return
    readable_file(args.pack, "furniture pack", InputError)
    pack, count = load_pack(args.pack), args.limit or ROOMS
    with RoomRenderer(pack) as renderer:
        yield room_cases(pack, renderer, kind=args.set, count=count), count
