"""`langflash query`: heat-maps, masks and numbers for phrases."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from langflash_core.errors import PromptError

from ..files import check_folder, checked_scene, staged_folder
from ..report import ProgressBar, write_json

if TYPE_CHECKING:
    from langflash_core.types import PromptAnswer, QueryResult, Scene


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
    from langflash_core.export.answers import write_answers

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


def spoken(prompts: Sequence[str]) -> list[str]:
    """Phrases without the white space around them.

    Raises:
        PromptError: one is empty.
    """
    phrases = [" ".join(prompt.split()) for prompt in prompts]
    if not all(phrases):
        raise PromptError('a prompt is empty; give a phrase such as "armchair"')
    return phrases


def answers_document(
    scene: "Scene", result: "QueryResult", files: Sequence[dict[str, str]]
) -> dict[str, Any]:
    """What `query --json` says of a view; `files` by kind, one entry a phrase."""
    metres = scene.record.metric_scale
    return {
        "mode": result.mode,
        "size": [result.camera.width, result.camera.height],
        "unit": "m" if metres else "scene",
        "prompts": [
            {**answer_fields(answer, metres or 1.0), "files": paths}
            for answer, paths in zip(result.answers, files, strict=True)
        ],
    }


def answer_fields(answer: "PromptAnswer", scale: float) -> dict[str, Any]:
    """The JSON of one answer; positions and sizes multiplied by `scale` (metres per scene unit)."""
    return {
        "prompt": answer.prompt,
        "found": answer.found,
        "score": answer.score,
        "threshold": answer.threshold,
        "area": answer.area,
        "centroid": answer.centroid and [scale * value for value in answer.centroid],
        "box": answer.box and scaled_box(answer.box, scale),
    }


def scaled_box(box: dict[str, Any], scale: float) -> dict[str, Any]:
    """Place and size multiplied by `scale`."""
    return {
        "center": [scale * value for value in box["center"]],
        "axes": [list(axis) for axis in box["axes"]],
        "size": [scale * value for value in box["size"]],
    }


def _line(entry: dict[str, Any], unit: str) -> str:
    found = "found    " if entry["found"] else "not found"
    line = f"{found}  {entry['prompt']}: score {entry['score']:.3f} (threshold {entry['threshold']:.3f})"
    if entry["found"]:
        where = ", ".join(f"{value:.2f}" for value in entry["centroid"])
        line += f", {entry['area']:.1%} of the picture, at ({where}) {'m' if unit == 'm' else 'scene units'}"
    return line + f"  -> {entry['files']['heat']}"
