"""`langflash words`: what was taught in some scenes, kept and taught to others."""

from argparse import Namespace
from pathlib import Path
from typing import Any, TextIO

from langflash_core.base.files import check_output_file
from langflash_core.errors import InputError, PromptError
from langflash_core.language.lessons import SUFFIX

from ..files import checked_scene
from ..report import tell


def run(args: Namespace, out: TextIO) -> None:
    """Learn, teach or list."""
    {"learn": _learn, "teach": _teach, "list": _list}[args.action](args, out)


def _learn(args: Namespace, out: TextIO) -> None:
    """Names and denials of scenes into one vocabulary; one that is there is added to."""
    if not args.output.name.endswith(SUFFIX):
        raise InputError(f"{args.output} is no vocabulary by its name; end it in {SUFFIX}")
    for path in args.scenes:
        checked_scene(path)
    check_output_file(args.output, (".json",))
    from langflash_core.appearance import appearances, own_network
    from langflash_core.language.lessons import lessons_of, read_lessons, write_lessons

    from ..scenes import open_scene

    known, learned, network = read_lessons(args.output) if args.output.exists() else None, 0, own_network()
    for path in args.scenes:
        scene = open_scene(path)
        if not {*scene.record.atom_names, *scene.record.atom_denials}:
            continue
        looks = appearances(scene, network)
        lessons = lessons_of(scene.record, looks.rows, looks.network)
        learned += len(lessons)
        known = lessons if known is None else known.joined(lessons)
    if known is None or not learned:
        raise PromptError(
            "nobody taught these scenes anything that their photos show; name a group in the window's "
            "dictionary, save the scene, and try again"
        )
    write_lessons(known, args.output)
    document = {"learned": learned, "words": len(known), "file": str(args.output)}
    tell(args, document, [f"learned {learned}, {len(known)} in {args.output}"], out)


def _teach(args: Namespace, out: TextIO) -> None:
    """What the groups of a scene take of a vocabulary, as names and denials of a new scene file."""
    checked_scene(args.scene)
    check_output_file(args.output, (".langflash",), inputs=[args.scene])
    from dataclasses import replace

    from langflash_core.appearance import lessons_taken
    from langflash_core.language.lessons import read_lessons, with_lessons
    from langflash_core.scene.file import save

    from ..scenes import open_scene

    lessons = read_lessons(args.words)
    scene = open_scene(args.scene)
    took = lessons_taken(scene, lessons)
    save(replace(scene, record=with_lessons(scene.record, took)), args.output)
    groups = [{"group": k, "name": one.name, "denied": list(one.denied)} for k, one in sorted(took.items())]
    lines = [f"group {group['group']}: {_said(group)}" for group in groups]
    lines.append(f"{len(groups)} of {scene.semantics.num_atoms} groups took something; {args.output}")
    tell(args, {"scene": str(args.output), "groups": groups}, lines, out)


def _list(args: Namespace, out: TextIO) -> None:
    """What a vocabulary holds."""
    from langflash_core.language.lessons import read_lessons

    lessons = read_lessons(Path(args.words)).lessons
    rows = [{"name": one.name, "denied": list(one.denied)} for one in lessons]
    tell(args, {"words": rows}, map(_said, rows), out)


def _said(row: dict[str, Any]) -> str:
    return ", ".join(filter(None, [row["name"], *(f"not {word}" for word in row["denied"])]))
