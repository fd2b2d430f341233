"""`langflash lab eval protocol`: a published data set, judged as papers judge it.

All raise `LangFlashError` where what is judged, the checkpoint or the output cannot be used.
"""

from argparse import Namespace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_folder
from langflash_core.errors import InputError
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.lab.photos import PhotoFolder, open_folder

from ...report import write_tables
from .scenes import check_files, opened

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.tallies import Shelf


def protocol(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint on a data set where it lies."""
    check_files(args)
    if args.work is not None:
        check_folder(args.work, "--work")
    if args.name == "nyu":
        _nyu(args, out)
        return
    from langflash_core.lab.evaluation.cases import Judge, Tally, case_tallies, cases_markdown, result_of
    from langflash_core.lab.evaluation.protocols import planned

    plan = planned(args.name, args.folder, args.index)
    with opened(args, Bench, words=True, align=args.align) as (bench, progress):
        tallies = case_tallies(
            Judge.of(bench),
            islice(plan.cases, args.limit),
            count=args.limit or plan.count,
            shelf=_shelf(args, Tally, bench),
            progress=progress,
        )
    result = {"protocol": args.name, "weights": bench.made_with, **result_of(tallies)}
    write_tables(args, result, cases_markdown(args.name, result), out)


def _nyu(args: Namespace, out: TextIO) -> None:
    """Single photos, as `eval photos-labelled` judges them."""
    for name in ("index", "lpips", "align"):
        if getattr(args, name):
            raise InputError(f"nyu judges photos one by one, without another view; leave --{name} out")
    folder = nyu_folder(args.folder)
    from langflash_core.lab.evaluation.labelled import Tally, run_photos, tables

    with opened(args, Bench, words=True) as (bench, progress):
        shelf = _shelf(args, Tally, bench)
        result, _ = run_photos(folder, folder.ids[: args.limit], bench, shelf=shelf, progress=progress)
    write_tables(args, result, markdown(tables(result)), out)


def nyu_folder(path: Path) -> PhotoFolder:
    """The labelled set as it was published, or as `train photos` keeps it.

    Raises:
        InputError: it is neither; says where the data set comes from.
    """
    from langflash_core.lab.evaluation.protocols import NYU_GET
    from langflash_core.lab.photos.published import open_nyu

    if path.is_file():
        return open_nyu(path)
    if (path / "nyu_depth_v2_labeled.mat").is_file():
        return open_nyu(path / "nyu_depth_v2_labeled.mat")
    if not (path / "images").is_dir():
        raise InputError(f"{path} holds no labelled NYU Depth v2; {NYU_GET}")
    folder = open_folder(path)
    if not folder.labelled:
        raise InputError(f"{path} has no names.csv, so nothing in it is labelled; add one, and labels/")
    return folder


def _shelf(args: Namespace, kind: type, bench: Bench) -> "Shelf | None":
    """Where cases are kept; another checkpoint, preset, size or data set makes them anew."""
    from langflash_core.lab.evaluation.tallies import Shelf, identity

    if args.work is None:
        return None
    key = {
        "protocol": args.name,
        "folder": str(args.folder.resolve()),
        "weights": identity(args.weights, args.preset),
        "size": args.size,
        "index": None if args.index is None else str(args.index.resolve()),
        "lpips": bench.lpips and bench.lpips.digest,
        "align": args.align,
    }
    return Shelf(args.work / args.name, key, kind)
