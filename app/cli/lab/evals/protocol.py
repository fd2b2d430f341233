"""`langflash lab eval protocol`: a published data set, judged as papers judge it."""

from argparse import Namespace
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_folder, check_output_file
from langflash_core.errors import InputError
from langflash_core.lab.photos import PhotoFolder, open_folder

from ...renderers import open_renderer
from ...report import ProgressBar, write_tables
from ..shared import opened_lpips

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.lpips import Lpips
    from langflash_core.lab.evaluation.tallies import Shelf


def protocol(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint on a data set where it lies.

    Raises:
        LangFlashError: data set, checkpoint or output cannot be used.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.work is not None:
        check_folder(args.work, "--work")
    if args.name == "nyu":
        _nyu(args, out)
        return
    from langflash_core.lab.evaluation.case_tables import cases_markdown
    from langflash_core.lab.evaluation.cases import Judge, Tally, case_tallies, result_of
    from langflash_core.lab.evaluation.protocols import PROTOCOLS, Case, planned

    plan = planned(args.name, args.folder, args.index)
    lpips = opened_lpips(args.lpips)
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        judge = Judge.of(
            renderer, args.weights, preset=args.preset, size=args.size, lpips=lpips, align=args.align
        )
        count = args.limit or plan.count

        def told() -> Iterator[Case]:
            for done, case in enumerate(islice(plan.cases, args.limit)):
                progress(f"{case.name}, {done + 1} of {count or 'some'}", done / count if count else 0.0)
                yield case

        tallies = list(case_tallies(judge, told(), _shelf(args, Tally, lpips)))
    chosen = PROTOCOLS[args.name]
    result = {"protocol": args.name, "weights": _weights(args), **result_of(tallies)}
    write_tables(args, result, cases_markdown(args.name, chosen.title, chosen.about, result), out)


def _nyu(args: Namespace, out: TextIO) -> None:
    """Single photos, as `eval photos-labelled` judges them.

    Raises:
        LangFlashError: an option that single photos have no use for, or what `protocol` says.
    """
    for name in ("index", "lpips", "align"):
        if getattr(args, name):
            raise InputError(f"nyu judges photos one by one, without another view; leave --{name} out")
    folder = nyu_folder(args.folder)
    ids = folder.ids[: args.limit]
    from langflash_core.lab.evaluation.labelled import Tally, run_photos
    from langflash_core.lab.evaluation.photo_tables import photos_markdown

    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        result, _ = run_photos(
            folder,
            ids,
            renderer,
            args.weights,
            preset=args.preset,
            size=args.size,
            shelf=_shelf(args, Tally),
            progress=progress,
        )
    write_tables(args, result, photos_markdown(result), out)


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


def _weights(args: Namespace) -> str:
    return str(args.weights) if args.weights else args.preset


def _shelf(args: Namespace, kind: type, lpips: "Lpips | None" = None) -> "Shelf | None":
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
        "lpips": lpips and lpips.digest,
        "align": args.align,
    }
    return Shelf(args.work / args.name, key, kind)
