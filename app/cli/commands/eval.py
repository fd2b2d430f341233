"""`langflash eval`: how good a checkpoint is on rooms it has never seen, and how it looks on photos."""

import io
import logging
import sys
from argparse import Namespace
from typing import TextIO

from langflash_core.errors import ImageError, InputError, WeightsError
from langflash_core.files import make_folder, write_atomically
from langflash_core.lab.evaluation.rooms import calibrate, run_eval
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.network import load_network

from ..files import check_output_file, readable_file
from ..renderers import open_renderer
from ..report import write_json
from .query import spoken


def run(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint, find the threshold from which a phrase counts as present, or draw a sheet.

    Raises:
        LangFlashError: the cache, the checkpoint or the output cannot be used.
    """
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", stream=sys.stderr)
    if args.weights is not None:
        readable_file(args.weights, "checkpoint", WeightsError)
    {"rooms": _rooms, "calibrate": _calibrate, "photos": _photos}[args.action](args, out)


def _check_cache(args: Namespace) -> None:
    if not args.cache.is_dir():
        raise InputError(f"there is no folder {args.cache}; make it with langflash train cache")


def _rooms(args: Namespace, out: TextIO) -> None:
    _check_cache(args)
    if args.output is not None:
        check_output_file(args.output, (".md",))
    result = run_eval(args.cache, args.weights, preset=args.preset, limit=args.limit)
    table = markdown(result)
    if args.output is not None:
        make_folder(args.output.parent)
        write_atomically(args.output, table.encode())
    if args.json:
        write_json(result, out)
    else:
        print(table, end="", file=out)


def _calibrate(args: Namespace, out: TextIO) -> None:
    _check_cache(args)
    network = load_network(args.preset, args.weights)
    document = {"calibration": calibrate(network, args.cache, limit=args.limit)}
    write_json(document, out)


def _photos(args: Namespace, out: TextIO) -> None:
    if len(args.photos) % 2:
        raise InputError(
            f"photos come in pairs, but these are {len(args.photos)}; give first and second in turn"
        )
    photos = [readable_file(path, "photo", ImageError) for path in args.photos]
    check_output_file(args.output, (".png",))
    from ..sheet import PROMPTS, pair_sheet

    pairs = list(zip(photos[::2], photos[1::2], strict=True))
    prompts = PROMPTS if args.prompt is None else spoken(args.prompt)
    with open_renderer(None) as renderer:
        sheet = pair_sheet(pairs, renderer, weights=args.weights, prompts=prompts)
    stream = io.BytesIO()
    sheet.save(stream, "PNG", optimize=True)
    make_folder(args.output.parent)
    write_atomically(args.output, stream.getvalue())
    print(f"{args.output}: {len(pairs)} pair{'s' * (len(pairs) > 1)}", file=out)
