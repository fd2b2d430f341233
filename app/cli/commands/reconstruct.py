"""`langflash reconstruct`: photos, or a film, to a scene file."""

import time
from argparse import Namespace
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from langflash_core.base.files import check_output_file, held_alone, readable_file
from langflash_core.base.keeping import forget, holds_steps
from langflash_core.errors import InputError, WeightsError

from ..files import checked_photos
from ..films import recorded, with_frames
from ..report import INTERRUPTED, ProgressBar, say_error, say_warnings, tell

if TYPE_CHECKING:
    from langflash_core.types import Scene


def run(args: Namespace, out: TextIO) -> int:
    """Check everything that can be checked, then predict, assemble, and write one file; the exit code: 0, or
    130 where Ctrl-C ended it and what was done is kept."""
    start = time.perf_counter()
    args.photos = checked_photos(args.photos)
    if args.weights is not None:
        readable_file(args.weights, "checkpoint", WeightsError)
    check_output_file(args.output, (".langflash",), inputs=args.photos)
    if args.poses and (args.fov is not None or args.intrinsics is not None):
        raise InputError("--poses says the lens too; leave --fov and --intrinsics out")
    with ProgressBar() as progress:
        args.photos, films, notes = with_frames(
            args.photos, progress, most=args.frames, start=args.start, end=args.end
        )
    try:
        scene = _written(args, films) if args.keep is None else _kept(args, films)
    except KeyboardInterrupt:
        if args.keep is None or not holds_steps(args.keep):
            raise
        say_error(f"stopped; progress is saved in {args.keep}, the same command continues from there")
        return INTERRUPTED
    from langflash_core.scene.report import describe, world_line

    described = describe(scene)
    say_warnings((*notes, *described["warnings"]))
    document = {
        "scene": str(args.output),
        **described,
        "file_bytes": args.output.stat().st_size,
        "seconds": round(time.perf_counter() - start, 3),
        **({"films": films} if films else {}),
    }
    world = scene.record.world
    standing = [] if world is None else [world_line(world, scene.record.metric_scale)]
    tell(args, document, [_sentence(args.output, scene, document), *standing], out)
    return 0


def _kept(args: Namespace, films: Sequence[dict[str, Any]]) -> "Scene":
    """The scene, once it is on the disk; what was kept goes then, and the folder once nothing is in it."""
    try:
        with held_alone(args.keep):
            scene = _written(args, films)
            forget(args.keep)
            return scene
    finally:
        with suppress(OSError):
            args.keep.rmdir()


def _written(args: Namespace, films: Sequence[dict[str, Any]]) -> "Scene":
    """The scene, once it is on the disk."""
    from langflash_core.reconstruction.ahead import begin

    ahead = begin(args.photos, preset=args.preset, weights=args.weights, size=args.size, keep=args.keep)
    ahead.check_photos()
    from langflash_core import pipeline
    from langflash_core.export.cameras import read_posed
    from langflash_core.scene.file import save

    intrinsics, viewmats = args.intrinsics, None
    if args.poses:
        posed = read_posed(args.poses).of(args.photos).upright()
        intrinsics, viewmats = posed.intrinsics, posed.viewmats
    with ProgressBar() as progress:
        said = list[str]()

        def told(stage: str, fraction: float) -> None:
            if ahead.gone_on and not said:
                said.append(f"continuing from the progress saved in {args.keep}")
                progress.say(said[0])
            progress(stage, fraction)

        scene = pipeline.reconstruct(
            args.photos,
            fov=args.fov,
            intrinsics=intrinsics,
            viewmats=viewmats,
            preset=args.preset,
            weights=args.weights,
            size=args.size,
            device=args.device,
            precision=args.precision,
            aggregation=args.aggregation,
            grouping=args.grouping,
            detail=args.detail,
            gaussians=args.gaussians,
            keep=args.keep,
            progress=told,
            ahead=ahead,
        )
        if films:
            left_out = {**scene.record.left_out, "films": [recorded(film) for film in films]}
            scene = scene.with_record(left_out=left_out)
        progress("writing", 1.0)
        args.output.parent.mkdir(parents=True, exist_ok=True)
        save(scene, args.output)
    return scene


def _sentence(path: Path, scene: "Scene", document: dict) -> str:
    return (
        f"{path}: {len(scene.gaussians):,} Gaussians in {scene.semantics.num_atoms} groups from "
        f"{scene.num_views} view{'s' * (scene.num_views > 1)}, "
        f"{document['file_bytes'] / 1e6:.1f} MB, {document['seconds']:.1f} s"
    )
