"""`langflash render`: one picture of a scene."""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from typing import Any, TextIO

from langflash_core.base.colormaps import HeatColours
from langflash_core.base.files import check_output_file, readable_file
from langflash_core.base.outputs import import_reference
from langflash_core.base.pictures import Picture
from langflash_core.base.request import trim_phrases
from langflash_core.errors import InputError, PromptError, SceneFileError
from langflash_core.export.paint import write_picture
from langflash_core.types import Scene
from langflash_core.writing.drawn import Look

from ..renderers import open_renderer
from ..report import ProgressBar, tell
from ..scenes import chosen_camera, open_scene, say_hints


def run(args: Namespace, out: TextIO) -> None:
    """Draw what was asked for and write it as a PNG."""
    picture, word, atom = args.what
    prompts = _prompts_for(picture, word, args.prompt)
    if args.fill and not picture.fills:
        raise InputError(f"--what {word} shows no colours to fill gaps with; leave --fill out")
    choice = chosen_camera(args).at_full_size()
    readable_file(args.scene, "scene", SceneFileError)
    check_output_file(args.output, (".png",), inputs=[args.scene])

    scene = open_scene(args.scene, args.axes)
    say_hints(scene, prompts)
    _check_atom(picture, atom, scene)
    camera, colours = choice.of(scene), HeatColours(args.colormap, args.span)
    with ProgressBar() as progress, open_renderer(args.backend, fade=args.fade, fill=args.fill) as renderer:
        progress("drawing", 0.2)
        look = Look(scene, camera, renderer, tuple(prompts), atom or 0, colours)
        pixels, more = import_reference(picture.painter)(look)
    write_picture(args.output, pixels)
    document = {
        "file": str(args.output),
        "what": word,
        "size": [camera.width, camera.height],
        "backend": renderer.backend,
        **more,
    }
    tell(args, document, [f"{args.output}: {word}, {camera.width} x {camera.height}", *_legend(more)], out)


def _prompts_for(picture: Picture, word: str, given: Sequence[str] | None) -> list[str]:
    if not picture.answers:
        if given:
            raise PromptError(f"--what {word} takes no --prompt; use --what relevance or labels")
        return []
    prompts = trim_phrases(given or [])
    if not prompts:
        raise PromptError(f'--what {word} needs a phrase; add --prompt "armchair"')
    if picture.one and len(prompts) > 1:
        raise PromptError(f"--what {word} draws one phrase; use --what labels for several")
    return prompts


def _check_atom(picture: Picture, atom: int | None, scene: Scene) -> None:
    count = scene.semantics.num_atoms
    if picture.columns and not count:
        raise InputError("this scene has no atoms to show, so there is nothing to colour; use --what rgb")
    if atom is not None and atom >= count:
        choice = f"use weights:0 to weights:{count - 1}" if count else "use --what rgb"
        raise InputError(f"there is no atom {atom}: this scene has {count}; {choice}")


def _legend(more: dict[str, Any]) -> Iterator[str]:
    for entry in more.get("prompts", ()):
        words = entry["prompt"], entry.get("colour", ""), "" if entry["found"] else "(not found)"
        yield f"  {' '.join(words).strip()}"
