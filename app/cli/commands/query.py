"""`langflash query`: heat-maps, masks and numbers for phrases."""

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from langflash_core.base.files import check_folder, staged_folder
from langflash_core.base.phrases import read_phrases
from langflash_core.base.request import trim_phrases
from langflash_core.errors import InputError
from langflash_core.language.settings import ANSWERING

from ..files import checked_scene
from ..report import ProgressBar, say_warnings, tell
from ..survey import run_survey

if TYPE_CHECKING:
    from langflash_core.language.relevance import Mode
    from langflash_core.types import Camera, Frame, QueryResult, Scene


def run(args: Namespace, out: TextIO) -> None:
    """Answer every phrase in one view and, with -o, write the pictures, all or none; or ask all scenes of a
    folder."""
    words = [args.scene, *args.phrases] if args.scenes and args.scene else args.phrases
    prompts = trim_phrases([*words, *([] if args.phrase_file is None else read_phrases(args.phrase_file))])
    if not prompts or not (args.scene or args.scenes):
        raise InputError("name a scene, or --scenes, and at least one phrase; see langflash query --help")
    negatives = None if args.negatives is None else trim_phrases(args.negatives)
    if args.scenes:
        run_survey(args, prompts, negatives, out)
    else:
        _one_scene(args, Path(args.scene), prompts, negatives, out)


def _one_scene(
    args: Namespace, path: Path, prompts: list[str], negatives: list[str] | None, out: TextIO
) -> None:
    if args.npz and args.output is None:
        raise InputError("--npz writes a file; add -o FOLDER")
    checked_scene(path)
    if args.output is not None:
        check_folder(args.output)
    from langflash_core import pipeline
    from langflash_core.export.answers import answers_document

    from ..renderers import open_renderer
    from ..scenes import chosen_camera, open_scene, taught_by

    choice = chosen_camera(args)
    if args.output is not None:  # lines alone need no larger picture
        choice = choice.at_full_size()
    scene = taught_by(args.vocabulary)(open_scene(path))
    camera = choice.of(scene)
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        progress("drawing", 0.2)
        result = pipeline.query(
            scene, prompts, camera=camera, mode=args.mode, negatives=negatives, render=renderer
        )
        notes = [answer.note for answer in result.answers if answer.note]
        if args.view is None and args.camera is None:
            progress("looking in the other photos", 0.6)
            notes += _elsewhere(scene, result, args.mode, negatives, renderer)
        progress("writing", 0.8)
        files = [{} for _ in result.answers] if args.output is None else _written(args, result)
    number = None if choice.view is None else choice.view + 1  # as people count
    document = {"scene": str(path), "view": number, "backend": renderer.backend}
    document.update(answers_document(scene, result, files))
    say_warnings(dict.fromkeys(notes))
    tell(args, document, (_line(entry, document["unit"]) for entry in document["prompts"]), out)


def _elsewhere(
    scene: "Scene",
    result: "QueryResult",
    mode: "Mode",
    negatives: list[str] | None,
    render: Callable[["Scene", "Camera"], "Frame"],
) -> list[str]:
    """A sentence for each phrase that was not found in the first photo and is found in another: the one whose
    own Gaussians answer it most, looked at."""
    from langflash_core import pipeline
    from langflash_core.language.gaussians import answering_shares, photos_that_answer
    from langflash_core.language.spaces import language_space
    from langflash_core.language.spoken import compile_spoken

    missed = [answer.prompt for answer in result.answers if not answer.found]
    if not missed:
        return []
    space = language_space(scene.semantics.space)
    compiled = compile_spoken(scene, space, missed, negatives=negatives, mode=mode)
    told, photos = [], photos_that_answer(answering_shares(scene, compiled))
    for prompt, view in zip(missed, photos, strict=True):
        if view:
            seen = pipeline.query(scene, [prompt], view=view, mode=mode, negatives=negatives, render=render)
            if seen.answers[0].found:
                said = f"{prompt!r} is not in photo 1, but photo {view + 1} shows it"
                told.append(f"{said}; add --view {view + 1}")
    return told


def _written(args: Namespace, result: "QueryResult") -> list[dict[str, str]]:
    """The files in the folder of -o, by kind, an entry a phrase."""
    from langflash_core.base.colormaps import HeatColours
    from langflash_core.export.answers import write_answers

    with staged_folder(args.output) as staging:
        staged = write_answers(result, staging, npz=args.npz, colours=HeatColours(args.colormap, args.span))
    return [{kind: str(args.output / Path(path).name) for kind, path in entry.items()} for entry in staged]


def _line(entry: dict[str, Any], unit: str) -> str:
    near = ANSWERING.maybe_from(entry["threshold"]) <= entry["score"] < entry["threshold"]
    found = "found    " if entry["found"] else "maybe    " if near else "not found"
    read = f" (read as: {entry['reading']})" if entry["reading"] else ""
    score = entry["score"]
    if near:  # rounded up it would be the threshold
        score = min(score, entry["threshold"] - 0.001)
    line = f"{found}  {entry['prompt']}{read}: score {score:.3f} (threshold {entry['threshold']:.3f})"
    if entry["found"]:
        where = ", ".join(f"{value:.2f}" for value in entry["centroid"])
        line += f", {entry['area']:.1%} of the picture, at ({where}) {'m' if unit == 'm' else 'scene units'}"
    return line + (f"  -> {entry['files']['heat']}" if entry["files"] else "")
