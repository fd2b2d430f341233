"""`langflash lab eval labels`: collected labels against the truth of rendered rooms."""

from argparse import Namespace
from typing import TextIO

from langflash_core.base.files import filled_atomically, readable_file, write_atomically
from langflash_core.errors import InputError
from langflash_core.lab.evaluation.clips import clips_markdown, clips_result, judged, rendered_clip
from langflash_core.lab.labels.making import REPORT, LabelMaker
from langflash_core.lab.labels.report import report
from langflash_core.lab.labels.storage import write_labels
from langflash_core.lab.rooms import RoomRenderer, load_pack

from ...report import ProgressBar, write_tables
from ..models import ordered
from .scenes import check_files


def labels(args: Namespace, out: TextIO) -> None:
    """Draw clips, label them, and judge every true thing.

    Raises:
        LangFlashError: pack, weights or output cannot be used, or a room has no way through it.
    """
    check_files(args)
    order = ordered(args)
    pack = load_pack(readable_file(args.pack, "furniture pack", InputError))
    maker, judgements = LabelMaker(order), []
    with ProgressBar() as progress, RoomRenderer(pack) as renderer:
        for seed in args.seed:
            truth = rendered_clip(seed, pack, renderer)
            if truth is None:
                raise InputError(f"the camera would run into something in room {seed}; choose another --seed")
            found = maker.label(truth.clip, progress)
            judgements.append((found, judged(truth, found.ids)))
            if args.results is not None:
                with filled_atomically(args.results / truth.clip.name) as staging:
                    write_labels(found, staging)
                    page, _ = report(truth.clip, found, maker.called)
                    write_atomically(staging / REPORT, page)
    result = clips_result(judgements)
    write_tables(args, result, clips_markdown(result), out)
