"""`langflash lab eval walk`, `sides`, `sharp`, `posed`, `real`, `photos-labelled` and `grouping`: what scenes
are like beside what is known of their photos; and `beside`, two versions on the same ones.

All raise `LangFlashError` where what is judged, the checkpoint or the output cannot be used.
"""

import io
import json
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

from PIL import Image

from langflash_core.base.files import (
    check_folder,
    check_output_file,
    make_folder,
    readable_file,
    write_atomically,
)
from langflash_core.base.formats import is_film, is_photo
from langflash_core.errors import ImageError, InputError, SceneFileError
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.tables import Measure, Pairs, markdown
from langflash_core.lab.evaluation.tables import beside as beside_table
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.rooms import Pack, RoomRenderer, load_pack

from ...films import look_through
from ...renderers import open_renderer
from ...report import ProgressBar, write_tables
from ..photos import chosen, opened_folder
from ..shared import colour_only, opened_lpips

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.posed import Triple
    from langflash_core.lab.evaluation.tallies import Shelf
    from langflash_core.lab.evaluation.walk_scenes import Bench as WalkBench
    from langflash_core.lab.evaluation.walk_subjects import Plan, Walk

AnyBench = TypeVar("AnyBench", bound=Bench)
PICTURES, WALKS = "pictures", "walks"
"""Folders of results: for sheets, and of single walks."""
PHOTOS = (4, 8, 16)
"""Of a scene of `eval real`."""
OPTIONS = (
    "size", "set", "exposure", "step", "assume_lens", "no_own", "align", "memory",
    "colmap", "depth_unit", "crop", "intrinsics", "passers", "screens",
)  # fmt: skip
"""By which numbers of a walk change."""


def opened(
    args: Namespace, kind: type[AnyBench], *, words: bool = False, **options: Any
) -> AbstractContextManager[tuple[AnyBench, ProgressBar]]:
    """What the options say scenes are made and judged with; LPIPS is read at once. words: weight maps are
    drawn, too."""
    lpips = opened_lpips(getattr(args, "lpips", None))

    @contextmanager
    def judging() -> Iterator[tuple[AnyBench, ProgressBar]]:
        with open_renderer(args.backend) as renderer, ProgressBar() as progress:
            render = renderer if words else colour_only(renderer)
            size = getattr(args, "size", None)
            yield kind(render, args.weights, args.preset, size, lpips, **options), progress

    return judging()


def check_files(args: Namespace) -> None:
    """What is written can be.

    Raises:
        InputError, OutputError: not so.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if getattr(args, "sheet", None) is not None:
        check_output_file(args.sheet, (".png",), option="--sheet")
    for name in ("results", "keep"):
        if getattr(args, name, None) is not None:
            check_folder(getattr(args, name), f"--{name}")


def write_sheet(path: Path, sheet: Image.Image) -> None:
    """As a PNG."""
    stream = io.BytesIO()
    sheet.save(stream, "PNG", optimize=True)
    make_folder(path.parent)
    write_atomically(path, stream.getvalue())


def write_results(folder: Path | None, name: str, result: dict) -> None:
    """What --results keeps."""
    if folder is not None:
        make_folder(folder)
        write_atomically(folder / f"{name}.json", json.dumps(result, indent=1).encode())


@contextmanager
def _rooms(path: Path) -> Iterator[tuple[Pack, RoomRenderer]]:
    """Furniture, and who draws rooms of it.

    Raises:
        InputError: the pack cannot be used.
    """
    pack = load_pack(readable_file(path, "furniture pack", InputError))
    with RoomRenderer(pack) as drawer:
        yield pack, drawer


def _posed_folder(args: Namespace, instead: str) -> PhotoFolder:
    """The folder --posed names.

    Raises:
        InputError: it cannot be used, or has no poses.
    """
    folder = opened_folder(args)
    if folder.poses is None:
        raise InputError(f"{args.folder} has no poses.txt; add it, or judge {instead}")
    return folder


def _triples(args: Namespace, folder: PhotoFolder, count: int) -> "list[Triple]":
    from langflash_core.lab.evaluation.posed import APART, chosen_triples

    return chosen_triples(folder.ids, args.limit or count, args.apart or APART)


def _check_source(args: Namespace) -> None:
    if (args.pack is None) == (args.folder is None):
        raise InputError("give either a furniture pack or a folder with --posed; not both, not none")


def sides(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint, and the code that runs it, by views from aside."""
    _check_source(args)
    if args.pack is not None and args.size is not None:
        raise InputError("rooms are drawn at the network's own size; leave --size out, or judge --posed")
    check_files(args)
    from langflash_core.lab.evaluation.sides import run_sides, tables

    judging = opened(args, Bench)
    with _side_cases(args) as (cases, count), judging as (bench, progress):
        result = run_sides(cases, count, bench, progress)
    write_results(args.results, "sides", result)
    write_tables(args, result, markdown(tables(result)), out)


@contextmanager
def _side_cases(args: Namespace) -> Iterator[tuple[Iterator, int]]:
    """What is judged, and how much of it."""
    from langflash_core.lab.evaluation.side_subjects import posed_cases, room_cases

    if args.folder is not None:
        folder = _posed_folder(args, "rooms")
        triples = _triples(args, folder, 40)
        yield posed_cases(folder, triples), len(triples)
        return
    count = args.limit or 100
    with _rooms(args.pack) as (pack, drawer):
        yield room_cases(pack, drawer, kind=args.set, count=count), count


def sharp(args: Namespace, out: TextIO) -> None:
    """Judge the code that makes scenes by their pictures at the photos' size."""
    if sum((bool(args.photos), args.folder is not None, args.pack is not None)) > 1:
        raise InputError("give photos, a folder with --posed, or furniture with --pack; not two of them")
    check_files(args)
    if args.beside is not None and not args.beside.is_dir():
        raise SceneFileError(f"there is no folder {args.beside}; make it with --keep, and give that of a way")
    from langflash_core.lab.evaluation.sharp import PLAIN, WAYS, Bench, run_sharp, tables

    ways = WAYS if args.detail is None else (PLAIN, *dict.fromkeys(args.detail))
    options = {"ways": ways, "beside": args.beside, "keep": args.keep}
    judging = opened(args, Bench, **options)
    with _subjects(args) as (subjects, count), judging as (bench, progress):
        result = run_sharp(subjects, count, bench, progress=progress)
    write_results(args.results, "sharp", result)
    write_tables(args, result, markdown(tables(result)), out)


@contextmanager
def _subjects(args: Namespace) -> Iterator[tuple[Any, int]]:
    """What is judged, and how much of it."""
    from langflash_core.lab.evaluation.sharp_subjects import pair_subjects, posed_subjects, room_subjects

    if args.folder is not None:
        folder = _posed_folder(args, "pairs of photos")
        triples = _triples(args, folder, 20)
        yield posed_subjects(folder, triples), len(triples)
    elif args.pack is not None:
        count = args.limit or 20
        with _rooms(args.pack) as (pack, drawer):
            yield room_subjects(pack, drawer, kind=args.set, count=count), count
    else:
        for path in args.photos:
            if not path.is_dir():
                readable_file(path, "photo", ImageError)
        pairs = pair_subjects(args.photos)[: args.limit]
        yield pairs, len(pairs)


def posed(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint on pairs of real photos of known poses."""
    check_files(args)
    folder = _posed_folder(args, "single photos with photos-labelled")
    from langflash_core.lab.evaluation.posed import PAIRS, run_posed, tables

    triples = _triples(args, folder, PAIRS)
    with opened(args, Bench, words=True, align=args.align) as (bench, progress):
        result = run_posed(folder, triples, bench, progress)
    write_tables(args, result, markdown(tables(result)), out)


def photos_labelled(args: Namespace, out: TextIO) -> None:
    """Judge a checkpoint on single real photos that somebody labelled."""
    check_files(args)
    folder = opened_folder(args)
    if not folder.labelled:
        raise InputError(
            f"{args.folder} has no names.csv, so nothing in it is labelled; add one, and labels/"
        )
    ids = chosen(args, folder)
    from langflash_core.lab.evaluation.labelled import run_photos, tables

    with opened(args, Bench, words=True) as (bench, progress):
        result, _ = run_photos(folder, ids, bench, progress=progress)
    write_tables(args, result, markdown(tables(result)), out)


def leads(args: Namespace, out: TextIO) -> None:
    """Learn what phrases of each kind start with, from labelled photos."""
    check_output_file(args.output, (".safetensors",))
    folder = opened_folder(args)
    ids = chosen(args, folder)
    from langflash_core.lab.evaluation.leads import learned_leads, write_leads

    with opened(args, Bench, words=True) as (bench, progress):
        found = learned_leads(folder, ids, bench, progress=progress)
    make_folder(args.output.parent)
    write_leads(args.output, found)
    print(f"{args.output}: of {len(ids)} photos", file=out)


def grouping(args: Namespace, out: TextIO) -> None:
    """Judge groups and parts of single real photos against what was named or outlined in them."""
    check_files(args)
    folder = opened_folder(args)
    ids = chosen(args, folder)
    from langflash_core.lab.evaluation.grouped import grouping_markdown, run_grouping
    from langflash_core.lab.training.stages.stage import guided
    from langflash_core.network import load_network

    network = guided(load_network(args.preset, args.weights))
    with ProgressBar() as progress:
        result = run_grouping(network, folder, ids, progress)
    write_tables(args, result, grouping_markdown(result), out)


def walk(args: Namespace, out: TextIO) -> None:
    """Judge the code that makes scenes of many photos."""
    _check_walk(args)
    from langflash_core.lab.evaluation.walk import run_walks, tables
    from langflash_core.lab.evaluation.walk_scenes import Bench
    from langflash_core.lab.evaluation.walk_subjects import KEPT, PHOTOS, planned

    from ..sheets.walk import keeper, walk_sheet

    plan = planned(args.photos or PHOTOS, args.kept or KEPT, "apart" if args.growing else "same")
    options = {"alone": not args.no_own} | {
        name: getattr(args, name) for name in ("align", "assume_lens", "memory", "colmap")
    }
    judging = opened(args, Bench, **options)
    with _walks(args, plan) as (walks, count), judging as (bench, progress):
        kept = {} if args.results is None else {
            "shelf": _shelf(args, plan, bench), "shown": keeper(args.results / PICTURES)
        }  # fmt: skip
        result = run_walks(walks, count, bench, progress=progress, **kept)
    write_results(args.results, "walk", result)
    if args.sheet is not None and args.results is not None:
        write_sheet(args.sheet, walk_sheet([("drawn", args.results / PICTURES)]))
    write_tables(args, result, markdown(tables(result)), out)


def _check_walk(args: Namespace) -> None:
    """What can be known before any work."""
    _check_source(args)
    if args.folder is not None and (args.exposure or args.passers or args.screens):
        raise InputError(
            "--exposure, --passers and --screens change drawn rooms; leave them out with --posed"
        )
    check_files(args)
    if args.sheet is not None and args.results is None:
        raise InputError("--sheet shows what --results keeps; give --results, too")
    if args.colmap:
        from langflash_core.lab.evaluation.walk_colmap import check_installed

        check_installed()


def _shelf(args: Namespace, plan: "Plan", bench: "WalkBench") -> "Shelf":
    """Where walks are kept; other weights, photos or options make them anew, other code does not."""
    from langflash_core.lab.evaluation.tallies import Rows, Shelf, identity

    key = {
        **{name: getattr(args, name) for name in OPTIONS},
        "source": str((args.pack or args.folder).resolve()),
        "weights": identity(args.weights, args.preset),
        "photos": {str(photos): frames for photos, frames in plan.chosen.items()},
        "kept": plan.kept,
        "lpips": bench.lpips and bench.lpips.digest,
    }
    return Shelf(args.results / WALKS, key, Rows)


@contextmanager
def _walks(args: Namespace, plan: "Plan") -> "Iterator[tuple[Iterator[Walk], int]]":
    """What is judged, and how much of it."""
    from langflash_core.lab.evaluation.walk_subjects import Camcorder, posed_walks, room_walks

    if args.folder is not None:
        count = args.limit or 4
        yield posed_walks(_posed_folder(args, "rooms"), plan, count, args.step), count
        return
    count = args.limit or 20
    camcorder = Camcorder(args.exposure or 0.0, passers=args.passers or 0, screens=args.screens or 0)
    with _rooms(args.pack) as (pack, drawer):
        yield room_walks(pack, drawer, plan, camcorder=camcorder, kind=args.set, count=count), count


def real(args: Namespace, out: TextIO) -> None:
    """Judge the code that makes scenes by real frames."""
    check_files(args)
    from langflash_core.lab.evaluation.real import Bench, judge, real_markdown, summary

    from ..sheets.real import Sheet

    cases, sheet = [], Sheet()
    with opened(args, Bench, fused=args.fused, alone=not args.no_own) as (bench, progress):
        frames = _frames(args.frames, progress)
        for photos in sorted(set(args.photos or (n for n in PHOTOS if 2 * n - 1 <= len(frames)))):
            sheet = Sheet()
            cases.append(judge(frames, photos, bench, progress, sheet.shown))
    if not cases:
        raise InputError(f"{len(frames)} frames are too few; give 7 or more, or choose with --photos")
    if args.sheet is not None:
        write_sheet(args.sheet, sheet.drawn())
    result = summary(cases)
    write_tables(args, result, real_markdown(result), out)


def _frames(given: Path, progress: ProgressBar) -> list[Path]:
    """Pictures of a folder in the order of their names, or the stills of a film.

    Raises:
        InputError: there is neither. FilmError: the film cannot be used.
    """
    if given.is_dir():
        return sorted(path for path in given.iterdir() if is_photo(path))
    if not is_film(given):
        raise InputError(f"{given} is neither a folder of frames nor a film; name one")
    readable_file(given, "film", ImageError)
    strip = look_through(given, progress)
    return [strip.path(index) for index in range(len(strip.stills))]


@dataclass(frozen=True)
class Kept:
    """What --results of a judgement holds. keys: of its numbers; cases: what it calls one; alike: what to say
    where two results have none in common; changes: of the cases of two versions."""

    keys: frozenset[str]
    cases: Callable[[int], str]
    alike: str
    changes: Callable[[Sequence[tuple[dict, dict]]], Iterator[tuple[Measure, Pairs]]]


def _kept() -> Mapping[str, Kept]:
    """By the judgement's name."""
    from langflash_core.lab.evaluation import sides, walk

    return {
        "sides": Kept(
            frozenset({"cases", "by_look"}),
            lambda count: f"{count} scenes",
            "scene in common; make both with the same rooms or pairs",
            sides.changes,
        ),
        "walk": Kept(
            frozenset({"cases", "by_photos"}),
            lambda count: f"{count} walk{'s' * (count != 1)}",
            "walk in common; make both along the same walks",
            walk.changes,
        ),
    }


def beside(args: Namespace, out: TextIO) -> None:
    """Two results of the same cases in one table.

    Raises:
        InputError: a folder holds no results, or they have no case in common.
    """
    check_files(args)
    known = [(name, kept) for name, kept in _kept().items() if (args.before / f"{name}.json").is_file()]
    if not known:
        raise InputError(f"{args.before} holds no result of eval sides or walk; make it with --results")
    ((name, kept), *_) = known
    before, after = (_cases(folder, name, kept) for folder in (args.before, args.after))
    pairs = [(row, after[case]) for case, row in before.items() if case in after]
    if not pairs:
        raise InputError(f"these results have no {kept.alike}")
    if args.sheet is not None:
        if name != "walk":
            raise InputError(f"eval {name} keeps no pictures; leave --sheet out")
        from ..sheets.walk import walk_sheet

        versions = [("before", args.before / PICTURES), ("after", args.after / PICTURES)]
        write_sheet(args.sheet, walk_sheet(versions))
    table = beside_table(f"measure ({kept.cases(len(pairs))})", kept.changes(pairs))
    write_tables(args, {}, markdown([table]), out)


def _cases(folder: Path, name: str, kept: Kept) -> dict[str, dict]:
    """The cases that a folder of results holds, by their names.

    Raises:
        InputError: none of this judgement.
    """
    path = readable_file(folder / f"{name}.json", f"result of eval {name}", InputError)
    try:
        found = json.loads(path.read_bytes())
    except ValueError:
        found = None
    if not isinstance(found, dict) or not kept.keys <= found.keys():
        raise InputError(f"{path} is no result of eval {name}; make it with --results")
    return {row["name"]: row for row in found["cases"]}
