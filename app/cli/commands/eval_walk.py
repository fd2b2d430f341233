"""`langflash eval walk`: the same place in 2, 4, 8 ... photos."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

from langflash_core.errors import InputError
from langflash_core.lab.rooms import RoomRenderer, load_pack

from ..files import check_output_file, readable_file
from ..photos import opened_folder
from ..renderers import open_renderer
from ..report import ProgressBar, write_tables
from .eval_protocol import opened_lpips
from .eval_sides import colour_only

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.walk_subjects import Walk

ROOMS, STRETCHES = 20, 4


def walk(args: Namespace, out: TextIO) -> None:
    """Judge the code that makes scenes of many photos.

    Raises:
        LangFlashError: pack, folder, checkpoint or output cannot be used.
    """
    if (args.pack is None) == (args.folder is None):
        raise InputError("give either a furniture pack or a folder with --posed; not both, not none")
    if args.output is not None:
        check_output_file(args.output, (".md",))
    from langflash_core.lab.evaluation.walk import Bench, run_walks
    from langflash_core.lab.evaluation.walk_tables import walk_markdown

    with _walks(args) as (walks, count), open_renderer(args.backend) as renderer, ProgressBar() as progress:
        bench = Bench(
            colour_only(renderer),
            args.weights,
            args.preset,
            args.size,
            assume_lens=args.assume_lens,
            given_poses=args.given_poses,
            alone=not args.no_own,
            align=args.align,
            lpips=opened_lpips(args.lpips),
        )
        result = run_walks(walks, count, bench, progress=progress)
    write_tables(args, result, walk_markdown(result), out)


@contextmanager
def _walks(args: Namespace) -> "Iterator[tuple[Iterator[Walk], int]]":
    """What is judged, and how much of it."""
    from langflash_core.lab.evaluation.walk_subjects import (
        KEPT,
        PHOTOS,
        Camcorder,
        planned,
        posed_walks,
        room_walks,
    )

    plan = planned(args.photos or PHOTOS, args.kept or KEPT, "apart" if args.growing else "same")
    if args.folder is not None:
        folder = opened_folder(args)
        if folder.poses is None:
            raise InputError(f"{args.folder} has no poses.txt; add it, or judge rooms")
        count = args.limit or STRETCHES
        yield posed_walks(folder, plan, count, args.step), count
        return
    pack, count = load_pack(readable_file(args.pack, "furniture pack", InputError)), args.limit or ROOMS
    camcorder = Camcorder(args.exposure or 0.0, args.blur or 0.0)
    with RoomRenderer(pack) as drawer:
        yield (
            room_walks(
                pack, drawer, plan, way=args.way, camcorder=camcorder, kind=args.set, count=count,
                first=args.first_seed,
            ),
            count,
        )  # fmt: skip
