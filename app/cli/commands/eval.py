"""`langflash eval`: how good a checkpoint is on rooms it has never seen."""

import logging
import sys
from argparse import Namespace
from typing import TextIO

from app.cli.files import check_output_file, readable_file
from app.cli.report import write_json
from langflash_core.errors import InputError, WeightsError
from langflash_core.evaluation.rooms import calibrate, run_eval
from langflash_core.evaluation.tables import markdown
from langflash_core.files import make_folder, write_atomically
from langflash_core.network import load_network


def run(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint, or find the threshold from which a phrase counts as present.

    Raises:
        LangFlashError: the cache, the checkpoint or the output cannot be used.
    """
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", stream=sys.stderr)
    if not args.cache.is_dir():
        raise InputError(f"there is no folder {args.cache}; make it with langflash train cache")
    if args.weights is not None:
        readable_file(args.weights, "checkpoint", WeightsError)
    {"rooms": _rooms, "calibrate": _calibrate}[args.action](args, out)


def _rooms(args: Namespace, out: TextIO) -> None:
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
    network = load_network(args.preset, args.weights)
    document = {"calibration": calibrate(network, args.cache, limit=args.limit)}
    write_json(document, out)
