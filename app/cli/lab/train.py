"""`langflash lab train`: render and encode rooms, train stages, join them into one checkpoint."""

import json
import logging
import sys
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

from langflash_core.base.files import check_folder, check_output_file, readable_file
from langflash_core.base.optional import optional_packages
from langflash_core.base.resources import asset_path
from langflash_core.errors import InputError, WeightsError
from langflash_core.lab.labels.lite import read_others, read_scores
from langflash_core.lab.labels.opinions import LiteNetwork, write_opinions
from langflash_core.lab.labels.outlines import write_outlines
from langflash_core.lab.labels.prompted import PromptedSam
from langflash_core.lab.photos import PhotoFolder, chosen_ids, open_folder
from langflash_core.lab.photos.layouts import convert
from langflash_core.lab.photos.reading import Source
from langflash_core.lab.photos.writing import FolderWriter
from langflash_core.lab.training.commands import (
    PhotoRun,
    run_adopt,
    run_cache,
    run_find_parts,
    run_late,
    run_recipe,
    run_second,
)
from langflash_core.lab.training.loop import LoopOptions
from langflash_core.lab.training.photos import run_photo_cache
from langflash_core.lab.training.ranks import joined, leads
from langflash_core.lab.training.recipes import Recipe, named_recipe, read_recipe
from langflash_core.lab.training.scenes import SceneSource, source_at
from langflash_core.lab.training.trained import run_export
from langflash_core.language.spaces import language_space
from langflash_core.network import PRESETS
from langflash_core.network.semantics.mobile_sam.model import load_mobile_sam

from ..report import ProgressBar
from .photos import opened_folder


def run(args: Namespace, out: TextIO) -> None:
    """Run one step of training; what it measures goes to stderr, line by line.

    Raises:
        LangFlashError: the furniture, the encoder, the cache or the output cannot be used.
    """
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", stream=sys.stderr)
    {
        "adopt": _adopt,
        "cache": _cache,
        "photos": _convert,
        "parts": _parts,
        "late": _late,
        "second": _second,
        "outlines": _outlines,
        "opinions": _opinions,
        "run": _run,
        "export": _export,
    }[args.action](args, out)


def _adopt(args: Namespace, out: TextIO) -> None:
    encoder = readable_file(args.encoder, "encoder checkpoint", WeightsError)
    local = readable_file(args.local, "XFeat checkpoint", WeightsError)
    check_output_file(args.output, (".safetensors",))
    print(f"{run_adopt(encoder, local, args.output, preset=args.preset)}: ready to train", file=out)


def _cache(args: Namespace, out: TextIO) -> None:
    if (args.pack is None) == (args.folder is None):
        raise InputError("give either a furniture pack or a folder with --photos; not both, not none")
    if args.folder is not None:
        _cache_photos(args, out)
        return
    readable_file(args.pack, "furniture pack", InputError)
    check_folder(args.output)
    count = run_cache(
        args.output,
        args.pack,
        _start_of(args, args.preset),
        kind=args.set,
        scenes=args.scenes,
        part=args.part,
        preset=args.preset,
    )
    print(f"{args.output / args.set}: {count} new rooms", file=out)


def _cache_photos(args: Namespace, out: TextIO) -> None:
    if args.set == "held_out":
        raise InputError("photos have no held-out set; choose --set train or validation")
    check_folder(args.output)
    folder = opened_folder(args)
    ids = chosen_ids(folder.ids, args.set)
    place = args.output / "photos" / args.set
    count = run_photo_cache(
        folder, ids, place, _start(args), copies=args.copies, part=args.part, preset=args.preset
    )
    print(f"{place}: {count} new views", file=out)


def _convert(args: Namespace, out: TextIO) -> None:
    further = {
        role: path
        for role in ("splits", "classes", "images", "camera")
        if (path := getattr(args, role)) is not None
    }
    if not args.source.exists():
        raise InputError(f"there is no {args.source}; give what was downloaded, unpacked")
    check_folder(args.output)
    with ProgressBar() as progress:
        count = convert(args.layout, Source(args.source, further, args.limit, progress), args.output)
    print(f"{args.output}: {count} photos", file=out)


def _outlines(args: Namespace, out: TextIO) -> None:
    readable_file(args.weights, "checkpoint of MobileSAM", WeightsError)
    check_folder(args.output)
    folder = opened_folder(args)
    ids = folder.ids[args.part[0] :: args.part[1]]
    sam = PromptedSam(load_mobile_sam(args.weights, args.side, args.device), args.grid)
    write_outlines(folder, ids, FolderWriter(args.output), sam, "MobileSAM")
    print(f"{args.output}: {len(ids)} photos outlined", file=out)


def _opinions(args: Namespace, out: TextIO) -> None:
    readable_file(args.weights, "TensorFlow Lite network", WeightsError)
    folder = opened_folder(args)
    with optional_packages():
        network = LiteNetwork(args.weights)
    count = write_opinions(folder, folder.ids[args.part[0] :: args.part[1]], network)
    print(f"{args.folder / 'opinions'}: {count} new photos", file=out)


def _parts(args: Namespace, out: TextIO) -> None:
    if not args.cache.is_dir():
        raise InputError(f"there is no folder {args.cache}; make it with langflash lab train cache")
    if args.run is not None and not args.run.is_dir():
        raise InputError(f"there is no folder {args.run}; make it with langflash lab train run")
    count = run_find_parts(args.cache, _start(args), args.run, part=args.part, preset=args.preset)
    print(f"{args.cache}: {count} new parts", file=out)


def _late(args: Namespace, out: TextIO) -> None:
    folder = _labelled(args)
    if args.names and not args.more:
        raise InputError("--names goes with --more; name other sets of photos with it")
    with joined(args.device) as device:
        state = run_late(_learned_from(args, folder, device), names=args.names)
        if leads():
            print(f"{args.output}: trained the late halves, {state.step} steps", file=out)


def _second(args: Namespace, out: TextIO) -> None:
    folder, weights, scores = _labelled(args), None, None
    if args.weights is not None:
        for path in args.weights:
            readable_file(path, "TensorFlow Lite network", WeightsError)
        with optional_packages():
            weights, scores = read_others(*args.weights), read_scores(args.weights[0])
    with joined(args.device) as device:
        state = run_second(_learned_from(args, folder, device), weights=weights, scores=scores)
        if leads():
            print(f"{args.output}: trained what reads the other networks, {state.step} steps", file=out)


def _labelled(args: Namespace) -> PhotoFolder:
    if not args.cache.is_dir():
        raise InputError(f"there is no folder {args.cache}; make it with langflash lab train cache")
    check_folder(args.output)
    folder = opened_folder(args)
    if not folder.labelled:
        raise InputError(f"{args.folder} has no names.csv, so its photos name nothing; give labelled ones")
    return folder


def _learned_from(args: Namespace, folder: PhotoFolder, device: str) -> PhotoRun:
    """What both `late` and `second` are given."""
    learned = chosen_ids(folder.ids, "train")
    kept = [id for id in folder.ids if id not in learned]
    options = replace(
        _options(args, args.minutes), device=device, **_faster(args), validate_s=min(300.0, 12 * args.minutes)
    )
    return PhotoRun(
        args.cache,
        folder,
        learned,
        kept[::2],  # the other half is for the threshold
        args.output,
        _start(args),
        language_space(PRESETS[args.preset].space).encode,
        options,
        more=[open_folder(place) for place in args.more],
        preset=args.preset,
    )


def _options(args: Namespace, minutes: float) -> LoopOptions:
    return LoopOptions(
        minutes=minutes,
        device=args.device,
        seed=args.seed,
        max_steps=args.max_steps,
        batches=args.batches,
        precision=args.precision,
        board=args.board,
    )


def _faster(args: Namespace) -> dict[str, Any]:
    """What a graphics card is told besides."""
    return {"workers": args.workers, "learning_rate": args.rate, "pictures": args.pictures}


def _run(args: Namespace, out: TextIO) -> None:
    if args.scenes is None and not args.cache.is_dir():
        raise InputError(f"there is no folder {args.cache}; make it with langflash lab train cache")
    if args.labels is not None and args.scenes is None:
        raise InputError("--labels are of clips; name their folder with --scenes")
    if args.outlined and args.scenes is not None:
        raise InputError("--scenes takes the place of rooms and of photos beside them; leave out --outlined")
    scenes = None if args.scenes is None else _source(args)
    if args.sam_teacher is not None:
        readable_file(args.sam_teacher, "checkpoint of MobileSAM", WeightsError)
    check_folder(args.output)
    with joined(args.device) as device:
        options = replace(_options(args, 0), device=device, **_faster(args))
        recipe = _recipe(args, options)
        if args.sam_teacher is not None and not any(plan.stage.dense for plan in recipe.plans):
            raise InputError(
                "no stage here regresses SAM's embedding; name grouping, or leave --sam-teacher away"
            )
        if args.outlined and not any(plan.stage.name == "grouping" for plan in recipe.plans):
            raise InputError(
                "no stage here learns from outlined photos; name grouping, or leave --outlined out"
            )
        encode = language_space(PRESETS[recipe.preset].space).encode
        start = _start_of(args, recipe.preset)
        run_recipe(
            recipe,
            args.cache,
            args.output,
            start,
            encode,
            from_scratch=args.from_scratch,
            scenes=scenes,
            outlined=[open_folder(place) for place in args.outlined],
            sam=args.sam_teacher,
        )
        if leads():
            print(f"{args.output}: trained {', '.join(p.stage.name for p in recipe.plans)}", file=out)


def _source(args: Namespace) -> SceneSource:
    if not args.scenes.is_dir():
        raise InputError(f"there is no folder {args.scenes}; give a data set as it was unpacked")
    check_folder(args.cache, "CACHE")
    args.cache.mkdir(parents=True, exist_ok=True)
    return source_at(args.scenes, args.labels)


_OF_RECIPES = {"seed": 0, "batches": None, "precision": "auto", "rate": None, "pictures": None}
"""Words that a recipe decides, and what they are where nobody says them."""


def _recipe(args: Namespace, options: LoopOptions) -> Recipe:
    named = args.stages is not None or args.minutes is not None
    if args.recipe is not None and not named:
        given = [word for word, usual in _OF_RECIPES.items() if getattr(args, word) != usual]
        if given:
            raise InputError(f"a recipe says itself what --{given[0]} is; leave that out, or write a recipe")
        return read_recipe(args.recipe, options)
    if args.recipe is None and args.stages is not None and args.minutes is not None:
        return named_recipe(
            args.stages, args.minutes, args.preset, options, sam_teacher=args.sam_teacher is not None
        )
    raise InputError("give either --stages with --minutes, or a --recipe; not both, not none")


def _export(args: Namespace, out: TextIO) -> None:
    if not args.run.is_dir():
        raise InputError(f"there is no folder {args.run}; make it with langflash lab train run")
    check_output_file(args.output, (".safetensors",))
    details = None if args.metadata is None else _details(args.metadata)
    path = run_export(
        args.run,
        args.output,
        _start_of(args, args.preset),
        preset=args.preset,
        metadata=details,
        named=args.named,
    )
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB", file=out)


def _start(args: Namespace) -> Path:
    path = args.start or asset_path(f"weights/{args.preset}.safetensors")
    return readable_file(path, "weights file", WeightsError)


def _start_of(args: Namespace, preset: str) -> Path | None:
    """The weights file to begin with; None: none is shipped for the preset, and what was imported will do."""
    try:
        path = args.start or asset_path(f"weights/{preset}.safetensors")
    except FileNotFoundError:
        return None
    return readable_file(path, "weights file", WeightsError)


def _details(path: Path) -> dict[str, Any]:
    readable_file(path, "metadata file", InputError)
    try:
        details = json.loads(path.read_bytes())
    except ValueError as problem:
        raise InputError(f"{path} is not JSON: {problem}; it holds an object for the model card") from None
    if not isinstance(details, dict):
        raise InputError(f"{path} must hold one JSON object, for the model card")
    return details
