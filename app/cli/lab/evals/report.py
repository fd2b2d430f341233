"""`langflash lab eval report`: everything that is at hand, judged and put on one page.

All raise `LangFlashError` where what is judged, the checkpoint or the output cannot be used.
"""

import shlex
import sys
import time
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_folder, make_folder, readable_file, write_atomically
from langflash_core.base.running import Progress
from langflash_core.errors import InputError, SceneFileError
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.photos import PhotoFolder, open_folder

from ....bench.machine import host
from ...renderers import open_renderer
from ...report import ProgressBar
from ...scenes import open_scene
from ..photos import chosen
from ..shared import opened_lpips

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.report import Sources
    from langflash_core.lab.evaluation.report_page import Report
    from langflash_core.lab.evaluation.report_parts import Section

FRAMES = 4
"""Of the scene, in every mode."""
WORK = "work"
"""Inside the output: tallies and pictures, so that a run that was ended goes on where it stopped."""


def report(args: Namespace, out: TextIO) -> None:
    """Write report.html, .md, .json and .csv."""
    from langflash_core.lab.evaluation import report_page
    from langflash_core.lab.evaluation.report import PUBLISHED, Workplace, plans
    from langflash_core.lab.evaluation.tallies import identity

    args.only = None
    if args.pack is not None:
        readable_file(args.pack, "furniture pack", InputError)
    if args.scene is not None:
        readable_file(args.scene, "scene", SceneFileError)
    if args.rooms is not None and not args.rooms.is_dir():
        raise InputError(f"there is no folder {args.rooms}; make it with langflash lab train cache")
    judges = plans(_sources(args))
    if not judges and args.scene is None:
        raise InputError("there is nothing to judge; give --rooms, --pack, --posed, --photos or --scene")
    for folder, option in ((args.output, "-o"), (args.small, "--small")):
        if folder is not None:
            check_folder(folder, option)
    with ProgressBar() as progress:
        drawn = [] if args.scene is None else [_drawing(args.scene, progress)]  # while nothing else runs
        with open_renderer(args.backend) as renderer:
            bench = Bench(renderer, args.weights, args.preset, lpips=opened_lpips(args.lpips))
            place = Workplace(bench, args.output / WORK, progress)
            found = [judge(place) for judge in judges] + drawn
            drawn_by = renderer.backend
    name = args.weights.name if args.weights else args.preset
    made = report_page.Report(
        found,
        PUBLISHED,
        shlex.join(["langflash", *(named(word) for word in sys.argv[1:])]),
        {**host(), "renderer": drawn_by},
        f"{name} ({identity(args.weights, args.preset)})",
        time.strftime("%Y-%m-%d"),
    )
    make_folder(args.output)
    for suffix, text in (
        ("html", report_page.html(made)),
        ("md", report_page.markdown(made)),
        ("json", report_page.document(made)),
        ("csv", report_page.numbers_csv(made)),
    ):
        write_atomically(args.output / f"report.{suffix}", text.encode())
    if args.small is not None:
        _write_small(made, args.small)
    told = ", ".join(f"{section.title}: {section.result['scenes']}" for section in found)
    print(f"{args.output / 'report.html'}: {told}", file=out)


def _drawing(path: Path, progress: Progress) -> "Section":
    """A scene drawn in every way that `langflash bench` knows."""
    from langflash_core.lab.evaluation.report_drawing import drawing_section

    from ....bench import measured_cases, scene_case

    case = scene_case(path.stem, open_scene(path), None, FRAMES, None)
    return drawing_section(measured_cases([case], None, progress))


def _sources(args: Namespace) -> "Sources":
    from langflash_core.lab.evaluation.report import Sources

    posed, photos = _posed_folder(args.posed), _labelled_folder(args)
    ids = () if photos is None else chosen(args, photos)
    return Sources(args.rooms, args.pack, posed, photos, ids, args.limit)


def _write_small(made: "Report", folder: Path) -> None:
    from langflash_core.lab.evaluation.report_page import markdown
    from langflash_core.lab.evaluation.report_small import small_document, small_plots

    make_folder(folder)
    files = {"report.json": small_document(made), "report.md": markdown(made), **small_plots(made)}
    for name, text in files.items():
        write_atomically(folder / name, text.encode())


def named(word: str) -> str:
    """A word of the command, paths by their last name: where something lies is nobody's business."""
    option, sign, value = word.rpartition("=")
    return f"{option}{sign}{Path(value).name}" if Path(value).is_absolute() else word


def _posed_folder(path: Path | None) -> PhotoFolder | None:
    if path is None:
        return None
    folder = open_folder(path)
    if folder.poses is None:
        raise InputError(f"{path} has no poses.txt; add it, or leave --posed out")
    return folder


def _labelled_folder(args: Namespace) -> PhotoFolder | None:
    path = args.photos
    if path is None:
        return None
    folder = open_folder(path).described(args.crop, args.intrinsics, args.depth_unit)
    if not folder.labelled:
        raise InputError(f"{path} has no names.csv, so nothing in it is labelled; add one, and labels/")
    return folder
