"""`langflash lab eval rooms`, `ablations`, `calibrate`, `level` and `moved`: what rendered rooms tell.

All raise `LangFlashError` where what is judged, the checkpoint or the output cannot be used.
"""

from argparse import Namespace
from pathlib import Path
from typing import TextIO

from langflash_core.base.files import (
    check_folder,
    check_output_file,
    make_folder,
    readable_file,
    write_atomically,
)
from langflash_core.errors import InputError
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.rooms.run import run_eval
from langflash_core.lab.evaluation.rooms.summary import tables as room_tables
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.lab.photos import chosen_ids
from langflash_core.lab.rooms import Pack, load_pack
from langflash_core.lab.training.cache import HELD_OUT_SEED
from langflash_core.language.leads import nearer_threshold
from langflash_core.network import load_network

from ...renderers import open_renderer
from ...report import ProgressBar, say_warnings, write_json, write_tables
from ..photos import opened_folder
from .scenes import check_files, opened


def _check_cache(args: Namespace) -> None:
    if not args.cache.is_dir():
        raise InputError(f"there is no folder {args.cache}; make it with langflash lab train cache")


def rooms(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint on held-out rooms."""
    _check_cache(args)
    check_files(args)
    result = run_eval(args.cache, args.weights, preset=args.preset, limit=args.limit)
    write_tables(args, result, markdown(room_tables(result)), out)


def ablations(args: Namespace, out: TextIO) -> None:
    """Judge every rival on the same rooms."""
    _check_cache(args)
    check_files(args)
    if args.work is not None:
        check_folder(args.work, "--work")
    from langflash_core.lab.evaluation.ablations import study
    from langflash_core.lab.evaluation.ablations.tables import ablation_markdown, summary
    from langflash_core.lab.evaluation.tallies import Shelf, identity, intervals, judged, merged

    key = {"weights": identity(args.weights, "mini"), "data": str(args.cache.resolve())}
    shelf = None if args.work is None else Shelf(args.work, key, study.Tally)
    with ProgressBar() as progress:
        setting, fits, count, cases = study.opened_study(
            args.cache, args.weights, limit=args.limit, shelf=shelf, progress=progress
        )
        kept = judged(
            cases,
            lambda record, _: study.judge(setting, fits, record),
            count=count,
            shelf=shelf and study.grouped_shelf(shelf, setting),
            progress=progress,
        )
    tallies = list(kept.values())
    result = {
        "weights": str(args.weights) if args.weights else "mini",
        "scenes": len(tallies),
        **summary(merged(tallies)),
        "intervals": intervals(tallies, summary),
    }
    write_tables(args, result, ablation_markdown(result), out)


def calibrate(args: Namespace, out: TextIO) -> None:
    """Find the threshold from which a phrase counts as present."""
    _check_cache(args)
    if args.plot is not None:
        check_output_file(args.plot, (".png",), option="--plot")
    from langflash_core.lab.evaluation.calibration import calibration, photos_asked, rooms_asked

    network = load_network(args.preset, args.weights)
    sets = {"rooms": rooms_asked(network, args.cache, limit=args.limit)}
    if args.folder is not None:
        folder = opened_folder(args)
        ids = chosen_ids(folder.ids, "validation", args.only)
        with opened(args, Bench, words=True) as (bench, progress):
            sets["photos"] = photos_asked(folder, ids, bench, progress)
    found = calibration(network, sets)
    if args.plot is not None:
        _plot(args.plot, sets, nearer_threshold(found["threshold"], found["temperature"]))
    write_json({"calibration": found}, out)


def _plot(path: Path, sets: dict, threshold: float) -> None:
    try:
        from langflash_core.lab.evaluation.calibration_plot import calibration_png
    except ImportError:
        say_warnings(
            ["the plot is left out, because matplotlib is missing; pip install matplotlib brings it"]
        )
        return
    make_folder(path.parent)
    write_atomically(path, calibration_png(sets, threshold))


def _held_out(args: Namespace, count: int) -> tuple[Pack, range]:
    """The pack, and the rooms' seeds: `count` unless --limit says how many."""
    check_files(args)
    pack = load_pack(readable_file(args.pack, "furniture pack", InputError))
    return pack, range(HELD_OUT_SEED, HELD_OUT_SEED + (args.limit or count))


def level(args: Namespace, out: TextIO) -> None:
    """Judge how held-out rooms stand, how large they are, what inventory and plan get right."""
    pack, seeds = _held_out(args, 100)
    from langflash_core.lab.evaluation.level import run_level, tables

    with ProgressBar() as progress:
        result = run_level(
            pack, seeds, photos=args.photos, keep=args.keep, things=not args.no_things, progress=progress
        )
    write_tables(args, result, markdown(tables(result)), out)


def moved(args: Namespace, out: TextIO) -> None:
    """Judge what is found of things that were moved between two scenes of a room."""
    pack, seeds = _held_out(args, 10)
    from langflash_core.lab.evaluation.moved import run_moved, tables

    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        result = run_moved(pack, seeds, renderer, keep=args.keep, progress=progress)
    write_tables(args, result, markdown(tables(result)), out)
