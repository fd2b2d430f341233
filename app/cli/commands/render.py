"""`langflash render`: one picture of a scene."""

from argparse import Namespace
from typing import Any, TextIO

import numpy as np

from langflash_core.colormaps import HeatColours
from langflash_core.errors import InputError, PromptError, SceneFileError
from langflash_core.export.colours import label_colours
from langflash_core.export.png import heat_over, to_8bit
from langflash_core.types import Camera, Scene

from .. import pictures
from ..cameras import chosen_camera
from ..files import check_output_file, readable_file
from ..pictures import write_picture
from ..renderers import Renderer, open_renderer
from ..report import ProgressBar, write_json
from ..scenes import open_scene
from .query import spoken

NEEDS_PROMPT = ("relevance", "labels")
OF_COLOURS = ("rgb", *NEEDS_PROMPT)


def run(args: Namespace, out: TextIO) -> None:
    """Draw what was asked for and write it as a PNG.

    Raises:
        LangFlashError: the scene, the camera, a phrase, the atom or the output cannot be used.
    """
    prompts = _prompts_for(args.what[0], args.prompt)
    if args.fill and args.what[0] not in OF_COLOURS:
        raise InputError(f"--what {args.what[0]} shows no colours to fill gaps with; leave --fill away")
    choice = chosen_camera(args)
    readable_file(args.scene, "scene", SceneFileError)
    check_output_file(args.output, (".png",), inputs=[args.scene])

    scene = open_scene(args.scene)
    _check_atom(args.what, scene)
    camera = choice.of(scene)
    with ProgressBar() as progress, open_renderer(args.backend, fade=args.fade, fill=args.fill) as renderer:
        progress("drawing", 0.2)
        pixels, more = _draw(
            args.what, prompts, scene, camera, renderer, HeatColours(args.colormap, args.span)
        )
    write_picture(args.output, pixels)
    document = {
        "file": str(args.output),
        "what": args.what[0],
        "size": [camera.width, camera.height],
        "backend": renderer.backend,
        **more,
    }
    if args.json:
        write_json(document, out)
    else:
        print(f"{args.output}: {args.what[0]}, {camera.width} x {camera.height}{_legend(more)}", file=out)


def _prompts_for(kind: str, given: list[str] | None) -> list[str]:
    if kind not in NEEDS_PROMPT:
        if given:
            raise PromptError(f"--what {kind} takes no --prompt; use --what relevance or labels")
        return []
    prompts = spoken(given or [])
    if not prompts:
        raise PromptError(f'--what {kind} needs a phrase; add --prompt "armchair"')
    if kind == "relevance" and len(prompts) > 1:
        raise PromptError("--what relevance draws one phrase; use --what labels for several")
    return prompts


def _check_atom(what: tuple[str, int | None], scene: Scene) -> None:
    atom, count = what[1], scene.semantics.num_atoms
    if what[0] == "atoms" and not count:
        raise InputError("this scene has no atoms to show, so there is nothing to colour; use --what rgb")
    if atom is not None and atom >= count:
        choice = f"use weights:0 to weights:{count - 1}" if count else "use --what rgb"
        raise InputError(f"there is no atom {atom}: this scene has {count}; {choice}")


def _draw(
    what: tuple[str, int | None],
    prompts: list[str],
    scene: Scene,
    camera: Camera,
    renderer: Renderer,
    colours: HeatColours,
) -> tuple[np.ndarray, dict[str, Any]]:
    """The pixels, and what JSON says about them beyond the file."""
    kind, atom = what
    if kind in NEEDS_PROMPT:
        return _draw_answer(kind, prompts, scene, camera, renderer, colours)
    frame = renderer(scene, camera, weight_maps=kind in ("atoms", "weights"))
    if kind == "depth":
        seen = frame.depths[frame.depths > 0]
        span = [seen.min().item(), seen.max().item()] if len(seen) else None
        return pictures.depth_picture(frame), {"depth_range": span}
    if kind == "atoms":
        return pictures.atom_picture(frame, scene.semantics.dictionary), {"atoms": scene.semantics.num_atoms}
    if atom is not None:
        return pictures.weight_picture(frame, atom), {"atom": atom}
    return to_8bit(frame.rgb), {}


def _draw_answer(
    kind: str,
    prompts: list[str],
    scene: Scene,
    camera: Camera,
    renderer: Renderer,
    colours: HeatColours,
) -> tuple[np.ndarray, dict[str, Any]]:
    from langflash_core import pipeline

    result = pipeline.query(scene, prompts, camera=camera, render=renderer)
    entries = [{"prompt": each.prompt, "found": each.found, "score": each.score} for each in result.answers]
    if kind == "relevance":
        threshold = result.answers[0].threshold
        lit = heat_over(result.relevance[0], result.frame.rgb, threshold, result.mode, colours)
        return to_8bit(lit), {"prompts": entries}
    for entry, colour in zip(entries, label_colours(len(prompts)), strict=True):
        entry["colour"] = "#" + bytes(colour).hex()
    return pictures.label_picture(result), {"prompts": entries}


def _legend(more: dict[str, Any]) -> str:
    words = [
        " ".join([entry["prompt"], entry.get("colour", ""), "" if entry["found"] else "(not found)"]).strip()
        for entry in more.get("prompts", ())
    ]
    return "".join(f"\n  {word}" for word in words)
