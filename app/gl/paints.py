"""How each picture of `langflash_core/pictures.py` is painted of what a renderer drew, by its name there."""

from collections.abc import Callable
from dataclasses import dataclass

import moderngl
import numpy as np

from langflash_core import pictures
from langflash_core.colormaps import HeatColours, colour_stops
from langflash_core.pictures import Picture, margin_span

from .renderer import SplatRenderer


@dataclass(frozen=True)
class Wanted:
    """What a picture is to show. colours: of the P phrases asked, in their order. cuts: P, from which
    relevance on they are there. active: the phrase of a heat-map, shown from `shown_from` on. atom: whose
    weights. shades: of heat-maps, their colour map also of all others."""

    colours: tuple[tuple[float, float, float], ...]
    cuts: tuple[float, ...]
    active: int
    shown_from: float
    atom: int
    shades: HeatColours


Paint = Callable[[SplatRenderer, Wanted], moderngl.Texture]


def _heat(renderer: SplatRenderer, wanted: Wanted) -> moderngl.Texture:
    ends = wanted.shades.ends(wanted.cuts[wanted.active])
    return renderer.heat_texture(wanted.active, wanted.shades.colormap, wanted.shown_from, True, ends)


def _masks(style: str) -> Paint:
    return lambda renderer, wanted: renderer.mask_texture(
        style, np.array(wanted.colours, np.float32), np.array(wanted.cuts, np.float32)
    )


def _margin(renderer: SplatRenderer, wanted: Wanted) -> moderngl.Texture:
    span = margin_span(len(wanted.cuts))
    return renderer.margin_texture(wanted.cuts[0], span, wanted.shades.colormap)


def _transmittance(renderer: SplatRenderer, wanted: Wanted) -> moderngl.Texture:
    colormap = wanted.shades.colormap
    return renderer.shown(
        "transmittance", "show_transmittance.frag", {"colour_stops": colour_stops(colormap)}, (colormap,)
    )


PAINTS: dict[Picture, Paint] = {
    pictures.RGB: lambda renderer, _: renderer.rgb_texture,
    pictures.HEAT: _heat,
    pictures.LABELS: lambda renderer, wanted: renderer.label_texture(
        np.array(wanted.colours, np.float32), min(wanted.cuts)
    ),
    pictures.ATOMS: lambda renderer, _: renderer.atom_texture(),
    pictures.DEPTH: lambda renderer, wanted: renderer.depth_texture(wanted.shades.colormap),
    pictures.MASKS: _masks("flat"),
    pictures.ISOLATE: _masks("isolate"),
    pictures.HIDE: _masks("hide"),
    pictures.DIM: _masks("dim"),
    pictures.FEATURES: lambda renderer, _: renderer.feature_texture(),
    pictures.WEIGHT: lambda renderer, wanted: renderer.weight_texture(wanted.atom, wanted.shades.colormap),
    pictures.TRANSMITTANCE: _transmittance,
    pictures.COVERAGE: lambda renderer, _: renderer.coverage_texture(),
    pictures.AGREEMENT: lambda renderer, wanted: renderer.agreement_texture(wanted.shades.colormap),
    pictures.MARGIN: _margin,
}
