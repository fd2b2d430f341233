"""`lab eval walk`: the same place in 2, 4, 8 ... photos."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

from PIL import Image

from langflash_core.base.files import check_folder, readable_file
from langflash_core.errors import InputError
from langflash_core.lab.rooms import RoomRenderer, load_pack

from ...renderers import Renderer, open_renderer
from ...report import ProgressBar, write_tables
from ..photos import opened_folder
from ..shared import colour_only, opened_lpips
from .results import PICTURES, Results, Versions, check_files

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.tallies import Shelf
    from langflash_core.lab.evaluation.walk import Bench
    from langflash_core.lab.evaluation.walk_subjects import Plan, Walk

ROOMS, STRETCHES = 20, 4
WALKS = "walks"
"""The folder of results that keeps single walks."""
OPTIONS = (
    "size", "set", "exposure", "step", "assume_lens", "no_own", "align", "memory",
    "colmap", "depth_unit", "crop", "intrinsics", "passers", "screens",
)  # fmt: skip
"""By which numbers of a walk change."""


def _sheet(versions: Versions) -> Image.Image:
    from ..sheets.walk import walk_sheet

    return walk_sheet(versions)


RESULTS = Results(
    "walk",
    "walk.json",
    frozenset({"cases", "by_photos"}),
    "walk in common; make both along the same walks",
    _sheet,
)


def walk(args: Namespace, out: TextIO) -> None:
    """Judge the code that makes scenes of many photos.

    Raises:
        LangFlashError: pack, folder, checkpoint or output cannot be used.
    """
    _check(args)
    from langflash_core.lab.evaluation.walk import run_walks
    from langflash_core.lab.evaluation.walk_tables import walk_markdown

    from ..sheets.walk import keeper

    plan = _plan(args)
    with _walks(args, plan) as (walks, count), open_renderer(args.backend) as renderer:
        bench = _bench(args, renderer)
        kept = {} if args.results is None else {
            "shelf": _shelf(args, plan, bench), "shown": keeper(args.results / PICTURES)
        }  # fmt: skip
        with ProgressBar() as progress:
            result = run_walks(walks, count, bench, progress=progress, **kept)
    if args.results is not None:
        RESULTS.write(args.results, result)
    if args.sheet is not None and args.results is not None:
        RESULTS.draw(args.sheet, [("drawn", args.results)])
    write_tables(args, result, walk_markdown(result), out)


def _check(args: Namespace) -> None:
    """What can be known before any work."""
    if (args.pack is None) == (args.folder is None):
        raise InputError("give either a furniture pack or a folder with --posed; not both, not none")
    if args.folder is not None and (args.exposure or args.passers or args.screens):
        raise InputError(
            "--exposure, --passers and --screens change drawn rooms; leave them out with --posed"
        )
    check_files(args)
    if args.results is not None:
        check_folder(args.results, "--results")
    if args.sheet is not None and args.results is None:
        raise InputError("--sheet shows what --results keeps; give --results, too")
    if args.colmap:
        from langflash_core.lab.evaluation.walk_colmap import check_installed

        check_installed()


def _plan(args: Namespace) -> "Plan":
    from langflash_core.lab.evaluation.walk_subjects import KEPT, PHOTOS, planned

    return planned(args.photos or PHOTOS, args.kept or KEPT, "apart" if args.growing else "same")


def _bench(args: Namespace, renderer: Renderer) -> "Bench":
    from langflash_core.lab.evaluation.walk_scenes import Bench

    return Bench(
        colour_only(renderer),
        args.weights,
        args.preset,
        args.size,
        assume_lens=args.assume_lens,
        alone=not args.no_own,
        align=args.align,
        lpips=opened_lpips(args.lpips),
        memory=args.memory,
        colmap=args.colmap,
    )


def _shelf(args: Namespace, plan: "Plan", bench: "Bench") -> "Shelf":
    """Where walks are kept; other weights, photos or options make them anew, other code does not."""
    from langflash_core.lab.evaluation.tallies import Shelf, identity
    from langflash_core.lab.evaluation.walk import Tally

    key = {
        **{name: getattr(args, name) for name in OPTIONS},
        "source": str((args.pack or args.folder).resolve()),
        "weights": identity(args.weights, args.preset),
        "photos": {str(photos): frames for photos, frames in plan.chosen.items()},
        "kept": plan.kept,
        "lpips": bench.lpips and bench.lpips.digest,
    }
    return Shelf(args.results / WALKS, key, Tally)


@contextmanager
def _walks(args: Namespace, plan: "Plan") -> "Iterator[tuple[Iterator[Walk], int]]":
    """What is judged, and how much of it."""
    from langflash_core.lab.evaluation.walk_subjects import Camcorder, posed_walks, room_walks

    if args.folder is not None:
        folder = opened_folder(args)
        if folder.poses is None:
            raise InputError(f"{args.folder} has no poses.txt; add it, or judge rooms")
        count = args.limit or STRETCHES
        yield posed_walks(folder, plan, count, args.step), count
        return
    pack, count = load_pack(readable_file(args.pack, "furniture pack", InputError)), args.limit or ROOMS
    camcorder = Camcorder(args.exposure or 0.0, passers=args.passers or 0, screens=args.screens or 0)
    with RoomRenderer(pack) as drawer:
        yield room_walks(pack, drawer, plan, camcorder=camcorder, kind=args.set, count=count), count
