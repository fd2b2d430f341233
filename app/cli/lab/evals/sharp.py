"""`langflash lab eval sharp`: how near pictures of scenes are to their photos, at the photos' size."""

import json
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_folder, make_folder, readable_file, write_atomically
from langflash_core.errors import ImageError, InputError, SceneFileError
from langflash_core.lab.evaluation.labelled import Render
from langflash_core.lab.rooms import RoomRenderer, load_pack

from ...renderers import open_renderer
from ...report import ProgressBar, write_tables
from ..photos import opened_folder
from ..shared import colour_only, opened_lpips
from .results import check_files

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.sharp import Bench
    from langflash_core.lab.evaluation.sharp_subjects import Subject

ROOMS, PAIRS = 20, 20
NUMBERS = "sharp.json"
"""What --results holds."""


def sharp(args: Namespace, out: TextIO) -> None:
    """Judge the code that makes scenes by their pictures at the photos' size.

    Raises:
        LangFlashError: photos, pack, folder, checkpoint or output cannot be used.
    """
    _check(args)
    from langflash_core.lab.evaluation.sharp import run_sharp
    from langflash_core.lab.evaluation.sharp_tables import sharp_markdown

    with (
        _subjects(args) as (subjects, count),
        open_renderer(args.backend) as renderer,
        ProgressBar() as progress,
    ):
        bench = _bench(args, colour_only(renderer))
        result = run_sharp(subjects, count, bench, progress=progress)
    if args.results is not None:
        make_folder(args.results)
        write_atomically(args.results / NUMBERS, json.dumps(result, indent=1).encode())
    write_tables(args, result, sharp_markdown(result), out)


def _check(args: Namespace) -> None:
    """What can be known before any work."""
    if sum((bool(args.photos), args.folder is not None, args.pack is not None)) > 1:
        raise InputError("give photos, a folder with --posed, or furniture with --pack; not two of them")
    check_files(args)
    for folder, option in ((args.results, "--results"), (args.keep, "--keep")):
        if folder is not None:
            check_folder(folder, option)
    if args.beside is not None and not args.beside.is_dir():
        raise SceneFileError(f"there is no folder {args.beside}; make it with --keep, and give that of a way")


def _bench(args: Namespace, render: Render) -> "Bench":
    from langflash_core.lab.evaluation.sharp import PLAIN, WAYS, Bench

    ways = WAYS if args.detail is None else (PLAIN, *dict.fromkeys(args.detail))
    return Bench(
        render,
        args.weights,
        args.preset,
        args.size,
        ways,
        opened_lpips(args.lpips),
        args.beside,
        args.keep,
    )


@contextmanager
def _subjects(args: Namespace) -> "Iterator[tuple[Iterator[Subject] | list[Subject], int]]":
    """What is judged, and how much of it."""
    from langflash_core.lab.evaluation.posed import APART, chosen_triples
    from langflash_core.lab.evaluation.sharp_subjects import pair_subjects, posed_subjects, room_subjects

    if args.folder is not None:
        folder = opened_folder(args)
        if folder.poses is None:
            raise InputError(f"{args.folder} has no poses.txt; add it, or judge pairs of photos")
        triples = chosen_triples(folder.ids, args.limit or PAIRS, args.apart or APART)
        yield posed_subjects(folder, triples), len(triples)
    elif args.pack is not None:
        pack, count = load_pack(readable_file(args.pack, "furniture pack", InputError)), args.limit or ROOMS
        with RoomRenderer(pack) as drawer:
            yield room_subjects(pack, drawer, kind=args.set, count=count), count
    else:
        for path in args.photos:
            if not path.is_dir():
                readable_file(path, "photo", ImageError)
        pairs = pair_subjects(args.photos)[: args.limit]
        yield pairs, len(pairs)
