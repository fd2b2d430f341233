"""`langflash lab eval`: how good a checkpoint is on rooms and photos it has never seen, and how it looks."""

import io
import logging
import sys
from argparse import Namespace
from pathlib import Path
from typing import TextIO

from langflash_core.base.files import check_output_file, make_folder, readable_file, write_atomically
from langflash_core.base.request import trim_phrases
from langflash_core.errors import ImageError, InputError, WeightsError
from langflash_core.lab.evaluation.rooms.run import run_eval
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.lab.photos import chosen_ids
from langflash_core.lab.training.stages.stage import guided
from langflash_core.language.leads import nearer_threshold
from langflash_core.network import load_network

from ..renderers import open_renderer
from ..report import ProgressBar, say_warnings, write_json, write_tables
from .evals.ablations import ablations
from .evals.beside import beside
from .evals.labels import labels
from .evals.level import level
from .evals.moved import moved
from .evals.phrases import phrases
from .evals.protocol import protocol
from .evals.real import real
from .evals.report import report
from .evals.sharp import sharp
from .evals.sides import sides
from .evals.walk import walk
from .photos import chosen, opened_folder
from .shared import opened_lpips


def run(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint, find the threshold from which a phrase counts as present, or draw a sheet.

    Raises:
        LangFlashError: the cache, the checkpoint or the output cannot be used.
    """
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", stream=sys.stderr)
    if getattr(args, "weights", None) is not None and args.action != "labels":
        readable_file(args.weights, "checkpoint", WeightsError)
    {
        "ablations": ablations,
        "beside": beside,
        "rooms": _rooms,
        "calibrate": _calibrate,
        "grouping": _grouping,
        "photos": _photos,
        "photos-labelled": _photos_labelled,
        "posed": _posed,
        "labels": labels,
        "leads": _leads,
        "level": level,
        "moved": moved,
        "phrases": phrases,
        "protocol": protocol,
        "real": real,
        "report": report,
        "sharp": sharp,
        "sides": sides,
        "walk": walk,
    }[args.action](args, out)


def _check_cache(args: Namespace) -> None:
    if not args.cache.is_dir():
        raise InputError(f"there is no folder {args.cache}; make it with langflash lab train cache")


def _rooms(args: Namespace, out: TextIO) -> None:
    _check_cache(args)
    if args.output is not None:
        check_output_file(args.output, (".md",))
    result = run_eval(args.cache, args.weights, preset=args.preset, limit=args.limit)
    write_tables(args, result, markdown(result), out)


def _photos_labelled(args: Namespace, out: TextIO) -> None:
    if args.output is not None:
        check_output_file(args.output, (".md",))
    folder = opened_folder(args)
    if not folder.labelled:
        raise InputError(
            f"{args.folder} has no names.csv, so nothing in it is labelled; add one, and labels/"
        )
    ids = chosen(args, folder)
    from langflash_core.lab.evaluation.labelled import run_photos
    from langflash_core.lab.evaluation.photo_tables import photos_markdown

    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        result, _ = run_photos(
            folder, ids, renderer, args.weights, preset=args.preset, size=args.size, progress=progress
        )
    write_tables(args, result, photos_markdown(result), out)


def _leads(args: Namespace, out: TextIO) -> None:
    check_output_file(args.output, (".safetensors",))
    folder = opened_folder(args)
    ids = chosen(args, folder)
    from langflash_core.lab.evaluation.leads import learned_leads, write_leads

    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        leads = learned_leads(folder, ids, renderer, args.weights, progress=progress)
    make_folder(args.output.parent)
    write_leads(args.output, leads)
    print(f"{args.output}: of {len(ids)} photos", file=out)


def _grouping(args: Namespace, out: TextIO) -> None:
    if args.output is not None:
        check_output_file(args.output, (".md",))
    folder = opened_folder(args)
    ids = chosen(args, folder)
    from langflash_core.lab.evaluation.grouped import grouping_markdown, run_grouping

    network = guided(load_network(args.preset, args.weights))
    with ProgressBar() as progress:
        result = run_grouping(network, folder, ids, progress)
    write_tables(args, result, grouping_markdown(result), out)


def _posed(args: Namespace, out: TextIO) -> None:
    if args.output is not None:
        check_output_file(args.output, (".md",))
    folder = opened_folder(args)
    if folder.poses is None:
        raise InputError(
            f"{args.folder} has no poses.txt; add it, or judge single photos with photos-labelled"
        )
    from langflash_core.lab.evaluation.photo_tables import posed_markdown
    from langflash_core.lab.evaluation.posed import APART, PAIRS, chosen_triples, run_posed

    triples = chosen_triples(folder.ids, args.limit or PAIRS, args.apart or APART)
    lpips = opened_lpips(args.lpips)
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        result = run_posed(
            folder,
            triples,
            renderer,
            args.weights,
            preset=args.preset,
            size=args.size,
            lpips=lpips,
            align=args.align,
            progress=progress,
        )
    write_tables(args, result, posed_markdown(result), out)


def _calibrate(args: Namespace, out: TextIO) -> None:
    _check_cache(args)
    if args.plot is not None:
        check_output_file(args.plot, (".png",), option="--plot")
    from langflash_core.lab.evaluation.calibration import calibration, photos_asked, rooms_asked

    network = load_network(args.preset, args.weights)
    sets = {"rooms": rooms_asked(network, args.cache, limit=args.limit)}
    if args.folder is not None:
        folder = opened_folder(args)
        ids = chosen_ids(folder.ids, "validation", args.only)
        with ProgressBar() as progress, open_renderer(args.backend) as renderer:
            sets["photos"] = photos_asked(
                folder, ids, renderer, args.weights, preset=args.preset, progress=progress
            )
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


def _photos(args: Namespace, out: TextIO) -> None:
    if len(args.photos) % 2:
        raise InputError(
            f"photos come in pairs, but these are {len(args.photos)}; give first and second in turn"
        )
    photos = [readable_file(path, "photo", ImageError) for path in args.photos]
    check_output_file(args.output, (".png",))
    from .sheets.pairs import PROMPTS, pair_sheet

    pairs = list(zip(photos[::2], photos[1::2], strict=True))
    prompts = PROMPTS if args.prompt is None else trim_phrases(args.prompt)
    with open_renderer(None) as renderer:
        sheet = pair_sheet(pairs, renderer, weights=args.weights, prompts=prompts)
    stream = io.BytesIO()
    sheet.save(stream, "PNG", optimize=True)
    make_folder(args.output.parent)
    write_atomically(args.output, stream.getvalue())
    print(f"{args.output}: {len(pairs)} pair{'s' * (len(pairs) > 1)}", file=out)
