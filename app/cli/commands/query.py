"""`langflash query`: heat-maps, masks and numbers for phrases."""

from argparse import Namespace
from pathlib import Path
from typing import Any, TextIO

from langflash_core.files import check_folder, staged_folder
from langflash_core.request import spoken

from ..files import checked_scene
from ..report import ProgressBar, write_json


def run(args: Namespace, out: TextIO) -> None:
    """Answer every phrase in one view and write the pictures, all or none.

    Raises:
        LangFlashError: the scene, a phrase, the camera or the folder cannot be used.
    """
    prompts = spoken(args.prompts)
    negatives = None if args.negatives is None else spoken(args.negatives)
    checked_scene(args.scene)
    check_folder(args.output)
    from langflash_core import pipeline
    from langflash_core.colormaps import HeatColours
    from langflash_core.export.answers import answers_document, write_answers

    from ..cameras import chosen_camera
    from ..renderers import open_renderer
    from ..scenes import open_scene

    choice = chosen_camera(args)
    scene = open_scene(args.scene)
    camera = choice.of(scene)
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        progress("drawing", 0.2)
        result = pipeline.query(
            scene, prompts, camera=camera, mode=args.mode, negatives=negatives, render=renderer
        )
        progress("writing", 0.8)
        with staged_folder(args.output) as staging:
            staged = write_answers(
                result, staging, npz=args.npz, colours=HeatColours(args.colormap, args.span)
            )
    files = [{kind: str(args.output / Path(path).name) for kind, path in entry.items()} for entry in staged]
    document = {"scene": str(args.scene), "view": choice.view, "backend": renderer.backend}
    document.update(answers_document(scene, result, files))
    if args.json:
        write_json(document, out)
    else:
        print("\n".join(_line(entry, document["unit"]) for entry in document["prompts"]), file=out)


def _line(entry: dict[str, Any], unit: str) -> str:
    found = "found    " if entry["found"] else "not found"
    line = f"{found}  {entry['prompt']}: score {entry['score']:.3f} (threshold {entry['threshold']:.3f})"
    if entry["found"]:
        where = ", ".join(f"{value:.2f}" for value in entry["centroid"])
        line += f", {entry['area']:.1%} of the picture, at ({where}) {'m' if unit == 'm' else 'scene units'}"
    return line + f"  -> {entry['files']['heat']}"
