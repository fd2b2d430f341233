"""`langflash bench`: how fast each way of drawing is, and what it gets wrong."""

from argparse import Namespace
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_folder, readable_file, staged_folder
from langflash_core.errors import InputError, OutputError, PromptError, SceneFileError

from ..report import ProgressBar, tell, write_json
from ..scenes import open_scene

if TYPE_CHECKING:
    from ...bench import Case

FRAMES = 8


def run(args: Namespace, out: TextIO) -> None:
    """Measure every mode on a scene or on generated ones; print a table, write JSON and CSV."""
    _check(args)
    from ...bench import csv_text, measured_cases, table

    cases = _cases(args)
    with ProgressBar() as progress:
        measured = measured_cases(cases, args.only, progress)
    if args.output is not None:
        with staged_folder(args.output) as staging:
            with (staging / "bench.json").open("w", encoding="ascii") as stream:
                write_json(measured, stream)
            (staging / "bench.csv").write_text(csv_text(measured), encoding="utf-8")
    tell(args, measured, [table(measured)], out)


def _check(args: Namespace) -> None:
    """What can be said before anything is loaded."""
    generated = args.paper or args.synthetic is not None
    if args.scene is None and not generated:
        raise InputError("there is no scene to measure; give one, or --synthetic 100000, or --paper")
    if args.scene is not None and generated:
        raise InputError("--synthetic and --paper generate their scene; leave the scene file out")
    if args.spread is not None and not generated:
        raise InputError("--spread is for generated scenes; add --synthetic or --paper, or leave it out")
    if args.prompt and (generated or args.atoms is not None):
        raise PromptError("generated atoms know no words; leave --prompt or --atoms out")
    if args.scene is not None:
        readable_file(args.scene, "scene", SceneFileError)
    if args.output is not None:
        if args.output.is_file():
            raise OutputError(f"cannot write to {args.output}: it is a file; give a folder")
        check_folder(args.output)


def _cases(args: Namespace) -> "list[Case]":
    from ...bench import cases, generated_atoms_case, paper_cases, scene_case, synthetic_case

    frames = args.frames or FRAMES
    spread = 1.0 if args.spread is None else args.spread
    if args.paper:
        atoms = args.atoms or cases.PAPER_ATOMS
        return paper_cases(args.synthetic or cases.PAPER_GAUSSIANS, atoms, args.size, frames, spread)
    if args.synthetic is not None:
        atoms = args.atoms or cases.SYNTHETIC_ATOMS
        return [synthetic_case(args.synthetic, atoms, args.size, frames, spread=spread)]
    scene, name = open_scene(args.scene), args.scene.stem
    if args.atoms is not None:
        return [generated_atoms_case(name, scene, args.atoms, args.size, frames)]
    return [scene_case(name, scene, args.size, frames, args.prompt)]
