"""`langflash eval sides` and `sides-beside`: scenes seen from aside, by one version of the code or by two."""

import io
import json
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from langflash_core.errors import InputError, WeightsError
from langflash_core.files import check_folder, check_output_file, make_folder, readable_file, write_atomically
from langflash_core.lab.evaluation.labelled import Render
from langflash_core.lab.evaluation.side_subjects import Case
from langflash_core.lab.rooms import RoomRenderer, load_pack
from langflash_core.types import Scene

from ...renderers import open_renderer
from ...report import ProgressBar, write_tables
from ..photos import opened_folder
from ..shared import colour_only

ROOMS, PAIRS = 100, 40
NUMBERS, PICTURES = "sides.json", "pictures"
"""What --results holds."""


def sides(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint, and the code that runs it, by views from aside.

    Raises:
        LangFlashError: pack, folder, checkpoint or output cannot be used.
    """
    if (args.pack is None) == (args.folder is None):
        raise InputError("give either a furniture pack or a folder with --posed; not both, not none")
    if args.pack is not None and args.size is not None:
        raise InputError("rooms are drawn at the network's own size; leave --size out, or judge --posed")
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.results is not None:
        check_folder(args.results)
    if args.sheet is not None:
        _check_sheet(args)
    from langflash_core.lab.evaluation.lpips import Lpips
    from langflash_core.lab.evaluation.side_tables import sides_markdown
    from langflash_core.lab.evaluation.sides import run_sides

    lpips = None if args.lpips is None else Lpips(readable_file(args.lpips, "LPIPS file", WeightsError))
    with _cases(args) as (cases, count), open_renderer(args.backend) as renderer, ProgressBar() as progress:
        render = colour_only(renderer)
        result = run_sides(
            cases,
            count,
            render,
            args.weights,
            preset=args.preset,
            size=args.size,
            lpips=lpips,
            progress=progress,
            made=_pictures(args, render),
        )
        if args.results is not None and args.pack is not None:
            from ..sheets.sides import draw_pairs

            draw_pairs(args.results / PICTURES, render, args.weights)
    if args.results is not None:
        make_folder(args.results)
        write_atomically(args.results / NUMBERS, json.dumps(result, indent=1).encode())
    if args.sheet is not None and args.results is not None:
        _write_sheet(args.sheet, [("drawn", args.results)])
    write_tables(args, result, sides_markdown(result), out)


def _check_sheet(args: Namespace) -> None:
    check_output_file(args.sheet, (".png",))
    if args.results is None or args.pack is None:
        raise InputError("--sheet shows what --results keeps of rooms; give a furniture pack and --results")


def _pictures(args: Namespace, render: Render) -> Callable[[Case, Scene], None]:
    """Keeps what the first rooms show, where results are kept."""
    shown = 0

    def made(case: Case, scene: Scene) -> None:
        nonlocal shown
        from ..sheets.sides import ROOMS as SHOWN
        from ..sheets.sides import draw_room

        if args.results is not None and args.pack is not None and shown < SHOWN:
            draw_room(args.results / PICTURES, shown, case, scene, render)
            shown += 1

    return made


def _write_sheet(path: Path, versions: Sequence[tuple[str, Path]]) -> None:
    from ..sheets.sides import side_sheet

    sheet = side_sheet([(title, folder / PICTURES) for title, folder in versions])
    stream = io.BytesIO()
    sheet.save(stream, "PNG", optimize=True)
    make_folder(path.parent)
    write_atomically(path, stream.getvalue())


def beside(args: Namespace, out: TextIO) -> None:
    """Two results of the same scenes in one table.

    Raises:
        InputError: a folder holds no results, or they have no scene in common.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.sheet is not None:
        check_output_file(args.sheet, (".png",))
    from langflash_core.lab.evaluation.side_tables import beside_markdown

    before, after = (_numbers(folder) for folder in (args.before, args.after))
    if not {row["name"] for row in before["cases"]} & {row["name"] for row in after["cases"]}:
        raise InputError("these results have no scene in common; make both with the same rooms or pairs")
    if args.sheet is not None:
        _write_sheet(args.sheet, [("before", args.before), ("after", args.after)])
    write_tables(args, {}, beside_markdown(before, after), out)


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
        yield room_cases(pack, renderer, kind=args.set, count=count, first=args.first_seed), count


def _numbers(folder: Path) -> dict:
    path = readable_file(folder / NUMBERS, "result of eval sides", InputError)
    try:
        found = json.loads(path.read_bytes())
    except ValueError:
        found = None
    if not isinstance(found, dict) or not {"cases", "by_look"} <= found.keys():
        raise InputError(f"{path} is no result of eval sides; make it with --results")
    return found
