"""`langflash lift`: plain splats that answer phrases afterwards."""

import time
from argparse import Namespace
from typing import TextIO

from langflash_core.base.files import check_output_file, make_folder, readable_file
from langflash_core.errors import ImageError, InputError, WeightsError

from ..renderers import open_renderer
from ..report import ProgressBar, say_warnings, tell
from ..scenes import open_scene


def run(args: Namespace, out: TextIO) -> None:
    """Draw views of the scene, or take photos with poses, and carry back what the network sees in them."""
    start = time.perf_counter()
    if args.photos and not args.poses:
        raise InputError("photos need --poses, a transforms.json or a COLMAP model in the scene's world")
    for photo in args.photos or ():
        readable_file(photo, "photo", ImageError)
    if args.weights is not None:
        readable_file(args.weights, "checkpoint", WeightsError)
    check_output_file(args.output, (".langflash", ".ply", ".glb"), inputs=[args.scene, *(args.photos or ())])
    scene = open_scene(args.scene, args.axes)
    from langflash_core.export import export
    from langflash_core.lift import lift, posed_views

    views, viewmats = None, None
    if args.poses:
        views, viewmats = posed_views(args.poses, args.photos or (), scene.record.shift)
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        lifted = lift(
            scene,
            views,
            viewmats,
            up=args.up,
            render=lambda scene, camera: renderer(scene, camera, weight_maps=False),
            weights=args.weights,
            progress=progress,
        )
        make_folder(args.output.parent)
        export(lifted, args.output)
    say_warnings(lifted.record.warnings[len(scene.record.warnings) :])
    document = {
        "scene": str(args.output),
        "gaussians": len(lifted.gaussians),
        "seen": lifted.record.counts["seen"],
        "atoms": lifted.semantics.num_atoms,
        "views": lifted.num_views,
        "seconds": round(time.perf_counter() - start, 3),
    }
    told = f"{len(lifted.gaussians):,} Gaussians in {lifted.semantics.num_atoms} groups"
    line = f"{args.output}: {told} from {lifted.num_views} views, {document['seconds']:.1f} s"
    tell(args, document, [line], out)
