"""`langflash lab eval`: how good a checkpoint is on rooms and photos it has never seen, and how it looks."""

import logging
import sys
from argparse import Namespace
from typing import TextIO

from langflash_core.base.files import check_output_file, readable_file
from langflash_core.base.request import trim_phrases
from langflash_core.errors import ImageError, InputError, WeightsError

from ..renderers import open_renderer
from .evals import rooms, scenes
from .evals.labels import labels
from .evals.phrases import phrases
from .evals.protocol import protocol
from .evals.report import report


def run(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint, find the threshold from which a phrase counts as present, or draw a sheet.

    Raises:
        LangFlashError: the cache, the checkpoint or the output cannot be used.
    """
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", stream=sys.stderr)
    if getattr(args, "weights", None) is not None and args.action != "labels":
        readable_file(args.weights, "checkpoint", WeightsError)
    {
        "ablations": rooms.ablations,
        "beside": scenes.beside,
        "rooms": rooms.rooms,
        "calibrate": rooms.calibrate,
        "grouping": scenes.grouping,
        "photos": _photos,
        "photos-labelled": scenes.photos_labelled,
        "posed": scenes.posed,
        "labels": labels,
        "leads": scenes.leads,
        "level": rooms.level,
        "moved": rooms.moved,
        "phrases": phrases,
        "protocol": protocol,
        "real": scenes.real,
        "report": report,
        "sharp": scenes.sharp,
        "sides": scenes.sides,
        "walk": scenes.walk,
    }[args.action](args, out)


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
    scenes.write_sheet(args.output, sheet)
    print(f"{args.output}: {len(pairs)} pair{'s' * (len(pairs) > 1)}", file=out)
