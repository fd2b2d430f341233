"""The models that label clips, as `labels` and `eval labels` name them; read without torch."""

from argparse import Namespace
from pathlib import Path

from langflash_core.base.files import readable_file
from langflash_core.errors import WeightsError
from langflash_core.lab.labels.order import LabelOrder


def ordered(args: Namespace) -> LabelOrder:
    """The options of the models, checked.

    Raises:
        LangFlashError: they do not fit, or weights are missing.
    """
    if args.masks == "mobile-sam" and args.weights:
        readable_file(Path(args.weights), "checkpoint of MobileSAM", WeightsError)
    local = args.weights and Path(args.weights).exists()
    weights = str(Path(args.weights).absolute()) if local else args.weights or ""
    return LabelOrder(args.masks, weights, args.side, args.follow, args.vectors)
