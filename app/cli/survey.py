"""`langflash query --scenes FOLDER`: phrases asked of all scenes of a folder."""

from argparse import Namespace
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TextIO

from langflash_core.base.files import check_folder, staged_folder
from langflash_core.errors import InputError, LangFlashError, PromptError

from .report import ProgressBar, say_warnings, tell


def run_survey(args: Namespace, phrases: Sequence[str], negatives: Sequence[str] | None, out: TextIO) -> None:
    """Ask scene after scene; those that cannot be asked are left out and named."""
    if args.view is not None or args.camera or args.size or args.ortho or args.npz:
        raise InputError("--scenes chooses the views; leave out --view, --camera, --size, --ortho and --npz")
    if args.output is None:
        raise InputError("--scenes writes a table and a page of pictures; add -o FOLDER")
    paths = scene_files(args.scenes)
    once: dict[str, str] = {}
    for phrase in phrases:
        once.setdefault(phrase.strip().lower(), phrase)
    check_folder(args.output)
    from langflash_core.base.colormaps import HeatColours
    from langflash_core.writing.survey import Reply, ask_scene, write_survey

    from .renderers import open_renderer
    from .scenes import open_scene, taught_by

    teach = taught_by(args.vocabulary)
    colours = HeatColours(args.colormap, args.span)
    replies: list[Reply] = []
    left_out: list[tuple[str, str]] = []
    with (
        ProgressBar() as progress,
        open_renderer(args.backend) as renderer,
        staged_folder(args.output) as staging,
    ):
        asked = partial(
            ask_scene, folder=staging, render=renderer, mode=args.mode, negatives=negatives, colours=colours
        )
        for place, path in enumerate(paths):
            progress(f"scene {place + 1} of {len(paths)}", 0.95 * place / len(paths))
            name = path.relative_to(args.scenes).with_suffix("").as_posix()
            try:
                replies += asked(teach(open_scene(path)), name, list(once.values()))
            except PromptError:  # of the phrases, so the next scene would say the same
                raise
            except LangFlashError as error:
                left_out.append((name, str(error)))
        if not replies:
            name, why = left_out[0]
            raise InputError(f"no scene of {args.scenes} can be asked ({name}: {why})")
        progress("writing", 0.95)
        document = write_survey(replies, left_out, staging)
    say_warnings(f"{name} was left out: {why}" for name, why in left_out)
    say_warnings(dict.fromkeys(one.answer.note for one in replies if one.answer.note))
    lines = []
    for row in document["prompts"]:
        found = [one for one in row["scenes"] if one["found"]]
        surest = ", ".join(f"{one['scene']} {one['score']:.2f}" for one in found[:3]) or "-"
        lines.append(f"{row['prompt']}: found in {len(found)} of {len(row['scenes'])} scenes: {surest}")
    lines.append(f"-> {args.output / 'index.html'}")
    tell(args, {"folder": str(args.output), **document}, lines, out)


def scene_files(folder: Path) -> list[Path]:
    """Scenes of a folder and of those in it, by name.

    Raises:
        InputError: there is no such folder, or no scene in it.
    """
    if not folder.is_dir():
        raise InputError(f"there is no folder {folder}; give one with .langflash files in it")
    paths = sorted(path for path in folder.rglob("*.langflash") if path.is_file())
    if not paths:
        raise InputError(f"{folder} holds no .langflash file; make some with `langflash batch`")
    return paths
