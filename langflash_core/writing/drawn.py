"""What `render` paints, one function a picture of `pictures.py`: pixels, and what JSON says about them.

Painted on the processor of numbers that either renderer gives, so that both give the same picture.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from langflash_core import pipeline
from langflash_core.base.colormaps import HeatColours
from langflash_core.export import paint
from langflash_core.export.colours import label_colours
from langflash_core.export.png import USUAL, heat_over, label_picture, to_8bit
from langflash_core.types import Camera, Frame, QueryResult, Scene
from langflash_core.writing.renderers import Renderer

Painted = tuple[np.ndarray, dict[str, Any]]  # (H, W) or (H, W, 3) uint8


@dataclass(frozen=True)
class Look:
    """A scene seen by a camera. prompts: phrases, where they are needed. atom: where one is shown."""

    scene: Scene
    camera: Camera
    renderer: Renderer
    prompts: tuple[str, ...] = ()
    atom: int = 0
    colours: HeatColours = USUAL

    def frame(self, weight_maps: bool = False) -> Frame:
        """What is drawn."""
        return self.renderer(self.scene, self.camera, weight_maps=weight_maps)

    def answer(self) -> QueryResult:
        """What answers the phrases."""
        return pipeline.query(self.scene, list(self.prompts), camera=self.camera, render=self.renderer)


def rgb(look: Look) -> Painted:
    """The scene's colours."""
    return to_8bit(look.frame().rgb), {}


def depth(look: Look) -> Painted:
    """Near bright, far dark, and the depths of the first and the last colour."""
    pixels, span = paint.depth_picture(look.frame())
    return pixels, {"depth_range": span and list(span)}


def atoms(look: Look) -> Painted:
    """Every atom in its own colour."""
    semantics = look.scene.semantics
    return paint.atom_picture(look.frame(True), semantics.dictionary), {"atoms": semantics.num_atoms}


def weight(look: Look) -> Painted:
    """One atom's weights, black to white."""
    return paint.weight_picture(look.frame(True), look.atom), {"atom": look.atom}


def relevance(look: Look) -> Painted:
    """One phrase's heat-map over the colours."""
    result = look.answer()
    lit_from = result.answers[0].lit_from
    lit = heat_over(result.relevance[0], result.frame.rgb, lit_from, result.mode, look.colours)
    return to_8bit(lit), {"prompts": _answer_records(result)}


def labels(look: Look) -> Painted:
    """Each pixel in the colour of the phrase that fits best."""
    result = look.answer()
    entries = _answer_records(result)
    for entry, colour in zip(entries, label_colours(len(entries)), strict=True):
        entry["colour"] = "#" + bytes(colour).hex()
    return label_picture(result), {"prompts": entries}


def _answer_records(result: QueryResult) -> list[dict[str, Any]]:
    return [{"prompt": each.prompt, "found": each.found, "score": each.score} for each in result.answers]
