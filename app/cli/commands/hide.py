"""`langflash hide`: what answers a phrase is blurred, pixelated or removed for good."""

from argparse import Namespace
from typing import TYPE_CHECKING, Any, TextIO

from langflash_core.base.files import check_output_file, make_folder
from langflash_core.errors import InputError

from ...places import forget_pictures
from ..files import checked_scene
from ..renderers import open_renderer
from ..report import ProgressBar, tell
from ..scenes import open_scene, say_hints

if TYPE_CHECKING:
    from langflash_core.mending.hiding import Hidden


def run(args: Namespace, out: TextIO) -> None:
    """Hide it, write the scene, and tell what was done."""
    if args.how == "remove" and args.blocks is not None:
        raise InputError("what is removed has no blocks; leave --blocks out, or choose --how pixels")
    if args.how != "remove" and args.open:
        raise InputError(f"--how {args.how} leaves no hole; leave --open out, or choose --how remove")
    checked_scene(args.scene)
    check_output_file(args.output, (".langflash",), inputs=[args.scene])
    if args.preview is not None:
        check_output_file(args.preview, (".png",), inputs=[args.scene, args.output], option="--preview")

    import torch

    from langflash_core.export.paint import write_picture
    from langflash_core.meant import answering
    from langflash_core.mending.hiding import Hiding, hide, preview
    from langflash_core.mending.looks import before_and_after
    from langflash_core.mending.settings import HIDING, RECIPE_DEFAULTS
    from langflash_core.scene.file import save

    blocks, margin = (
        usual if told is None else told
        for told, usual in ((args.blocks, HIDING.blocks), (args.margin, RECIPE_DEFAULTS.margin))
    )
    hiding = Hiding(args.how, blocks, margin, args.photos == "painted", not args.open)
    scene = open_scene(args.scene)
    say_hints(scene, args.prompts)
    members = torch.from_numpy(answering(scene, tuple(args.prompts), args.threshold))
    picture = None
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        done, report = hide(scene, members, renderer, hiding, progress)
        if args.preview is not None:
            rows = preview(scene, members, renderer, margin)
            picture = (before_and_after(scene, rows, done, renderer) * 255).round().byte().numpy()
    make_folder(args.output.parent)
    save(done, args.output)
    forget_pictures([args.scene, args.output])
    if args.preview is not None and picture is not None:
        write_picture(args.preview, picture)
    document = {"scene": str(args.output), "prompts": args.prompts, **report.document()}
    tell(args, document, _lines(document, report), out)


def _lines(document: dict[str, Any], report: "Hidden") -> list[str]:
    """What was done, for people."""
    verb = {"blur": "blurred", "pixels": "made pixels of", "remove": "removed"}[report.how]
    total = report.members + report.rim
    lines = [f"{document['scene']}: {verb} {total:,} Gaussians, {report.rim:,} of them around the edge"]
    if report.side:
        lines.append(f"  {report.made:,} in their place, in blocks of {report.side:.3g} scene units")
    elif report.made:
        lines.append(f"  {report.made:,} in the hole, made of what is around it")
    if report.photos_left_out:
        lines.append("  the photos were left out of the file")
    lines += [
        f"  photo {view + 1}: {share:.1%} of its pixels painted over" for view, share in report.photos.items()
    ]
    if report.names:
        lines.append(f"  names that went with it: {', '.join(report.names)}")
    if report.unknown:
        lines.append(f"  left out, since nobody knows what it shows: {', '.join(report.unknown)}")
    return [*lines, "  the scene that was read, and photos on the disk, still show it"]
