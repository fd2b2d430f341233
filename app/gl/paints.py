"""How each picture of `base/pictures.py` is painted of what a renderer drew, by its name there."""

from collections.abc import Callable
from dataclasses import dataclass

import moderngl
import numpy as np

from langflash_core.base import pictures
from langflash_core.base.colormaps import HeatColours, colour_stops
from langflash_core.base.formats import COLOUR_MAPS
from langflash_core.base.pictures import Picture, margin_span

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


def masks(renderer: SplatRenderer, style: str, colours: np.ndarray, cuts: np.ndarray) -> moderngl.Texture:
    """What passes its own phrase's cut, in one of `MASK_STYLES`: "flat" in the phrase's colour, "isolate"
    alone, "hide" left out, "dim" the rest dimmed. colours: (P, 3) in [0, 1]; cuts: (P,)."""
    picture, answer, _ = renderer.answered()
    return picture.view.display.masks(picture.drawn, answer, style, colours, cuts)


def _masks(style: str) -> Paint:
    return lambda renderer, wanted: masks(
        renderer, style, np.array(wanted.colours, np.float32), np.array(wanted.cuts, np.float32)
    )


def margin(
    renderer: SplatRenderer, cut: float, span: tuple[float, float], colormap: str, over_rgb: bool = True
) -> moderngl.Texture:
    """The best phrase's relevance less the second best's; of one phrase, less `cut`."""
    picture, answer, _ = renderer.answered()
    return picture.view.display.margin(picture.drawn, answer, cut, span, colormap, over_rgb)


def _margin(renderer: SplatRenderer, wanted: Wanted) -> moderngl.Texture:
    return margin(renderer, wanted.cuts[0], margin_span(len(wanted.cuts)), wanted.shades.colormap)


def depth(renderer: SplatRenderer, colormap: str = COLOUR_MAPS[0]) -> moderngl.Texture:
    """Depth as a colour, near to far over the middle 96 % of the Gaussians in view."""
    picture = renderer.picture()
    near, far = picture.depth_range
    span = (float(near), float(max(far, near * 1.001)))
    return picture.view.display.depth(picture.drawn, span, colormap)


def trust(renderer: SplatRenderer, own: bool, colormap: str = COLOUR_MAPS[0]) -> moderngl.Texture:
    """How many photos saw what each pixel shows, in `COUNT_COLOURS`; or how well their `own` depths agree
    there, grey where fewer than two can tell. The first call draws the photos' views.

    Raises:
        ValueError: `own`, and the scene does not say which photo made which Gaussian.
    """
    picture = renderer.picture()
    photos = picture.scene.photo_depths(own)
    return picture.view.display.trust(picture.drawn, photos, own, colormap)


def _transmittance(renderer: SplatRenderer, wanted: Wanted) -> moderngl.Texture:
    picture, colormap = renderer.picture(), wanted.shades.colormap
    stops = {"colour_stops": colour_stops(colormap)}
    return picture.view.display.shown(
        picture.drawn, "transmittance", "show_transmittance.frag", stops, (colormap,)
    )


PAINTS: dict[Picture, Paint] = {
    pictures.RGB: lambda renderer, _: renderer.rgb_texture,
    pictures.HEAT: _heat,
    pictures.LABELS: lambda renderer, wanted: renderer.label_texture(
        np.array(wanted.colours, np.float32), min(wanted.cuts)
    ),
    pictures.ATOMS: lambda renderer, _: renderer.picture().atoms(),
    pictures.DEPTH: lambda renderer, wanted: depth(renderer, wanted.shades.colormap),
    pictures.MASKS: _masks("flat"),
    pictures.ISOLATE: _masks("isolate"),
    pictures.HIDE: _masks("hide"),
    pictures.DIM: _masks("dim"),
    pictures.FEATURES: lambda renderer, _: renderer.picture().features(),
    pictures.WEIGHT: lambda renderer, wanted: renderer.picture().weight(wanted.atom, wanted.shades.colormap),
    pictures.TRANSMITTANCE: _transmittance,
    pictures.COVERAGE: lambda renderer, _: trust(renderer, False),
    pictures.AGREEMENT: lambda renderer, wanted: trust(renderer, True, wanted.shades.colormap),
    pictures.MARGIN: _margin,
}
