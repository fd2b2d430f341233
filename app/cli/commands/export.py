"""`langflash export`: a scene, or what answers a phrase, as a file other programs read."""

from argparse import Namespace
from typing import TextIO

from torch import Tensor

from app.cli import pictures
from app.cli.cameras import chosen_camera
from app.cli.commands.query import spoken
from app.cli.files import check_output_file, readable_file
from app.cli.pictures import write_picture
from app.cli.renderers import open_renderer
from app.cli.report import ProgressBar
from langflash_core.errors import PromptError, SceneFileError
from langflash_core.types import QueryResult

SUFFIXES = (".png",)


def run(args: Namespace, out: TextIO) -> None:
    """Write the picture of a view, or with --prompt the cut-out of what answers it.

    Raises:
        LangFlashError: the scene, a phrase, the camera or the output cannot be used, or
            nothing in the view answers.
    """
    prompts = spoken(args.prompt or [])
    if args.threshold is not None and not prompts:
        raise PromptError('--threshold needs a phrase; add --prompt "armchair"')
    choice = chosen_camera(args)
    readable_file(args.scene, "scene", SceneFileError)
    check_output_file(args.output, SUFFIXES, inputs=[args.scene])
    from langflash_core import pipeline
    from langflash_core.export.png import to_8bit
    from langflash_core.scene import load

    scene = load(args.scene)
    camera = choice.of(scene)
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        progress("drawing", 0.2)
        if prompts:
            result = pipeline.query(scene, prompts, camera=camera, threshold=args.threshold, render=renderer)
            pixels = pictures.cut_out(result.frame, _found(result))
        else:
            pixels = to_8bit(renderer(scene, camera, weight_maps=False).rgb)
    write_picture(args.output, pixels)
    print(f"{args.output}: {camera.width} x {camera.height}", file=out)


def _found(result: QueryResult) -> Tensor:
    """Masks (P, H, W) of the phrases that are there.

    Raises:
        PromptError: none is.
    """
    if not any(answer.found for answer in result.answers):
        asked = ", ".join(answer.prompt for answer in result.answers)
        best = max(answer.score for answer in result.answers)
        raise PromptError(f"not found in this view: {asked} (best score {best:.3f}); lower --threshold")
    return result.masks[[answer.found for answer in result.answers]]
