"""`langflash add`: more photos for a finished scene."""

import time
from argparse import Namespace
from typing import TextIO

from langflash_core.base.files import check_output_file

from ..files import checked_photos, checked_scene
from ..report import ProgressBar, say_warnings, tell


def run(args: Namespace, out: TextIO) -> None:
    """The scene of -o: the one that there is, with a layer of each of these photos."""
    start = time.perf_counter()
    checked_scene(args.scene)
    photos = checked_photos(args.photos)
    check_output_file(args.output, (".langflash",), inputs=[args.scene, *photos])
    from langflash_core import pipeline
    from langflash_core.scene.file import load, save
    from langflash_core.scene.report import describe

    scene = load(args.scene)
    with ProgressBar() as progress:
        grown = pipeline.add_photos(scene, photos, device=args.device, progress=progress)
        progress("writing", 1.0)
        args.output.parent.mkdir(parents=True, exist_ok=True)
        save(grown, args.output)
    say_warnings([line for line in grown.record.warnings if line not in scene.record.warnings])
    seconds = round(time.perf_counter() - start, 3)
    more = grown.num_views - scene.num_views
    line = f"{args.output}: {more} photo{'s' * (more > 1)} more, {grown.num_views} in all; "
    line += f"{len(grown.gaussians):,} Gaussians, {seconds:.1f} s"
    tell(args, {"scene": str(args.output), **describe(grown), "seconds": seconds}, [line], out)
