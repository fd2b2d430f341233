"""The two places where OpenGL runs, and what each does in its own way; the pictures are the same."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import moderngl

from langflash_core.base.graphics import draws_in_software

from .answers import MakeAnswers, ShaderAnswers
from .processor.cell_maps import CellMaps
from .processor.host import HostAnswers
from .processor.sprites import Sprites
from .shapes import MakeShapes, Quads
from .splats import MakeSplats, SplatBuffers
from .weights import MakeMaps, WeightMaps


@dataclass(frozen=True)
class Hardware:
    """shapes: what Gaussians are drawn as. maps: how weight maps come about. answers: who multiplies them
    with phrases. blends_all: whether moving pictures of a scene of layers are blended of as many as resting
    ones, and not of few and smaller ones (layered.py). defines: of all shaders. splats: who draws them."""

    shapes: MakeShapes
    maps: MakeMaps
    answers: MakeAnswers
    blends_all: bool
    defines: Mapping[str, float] = field(default_factory=dict)
    splats: MakeSplats = SplatBuffers


CARD = Hardware(Quads, WeightMaps, ShaderAnswers, blends_all=True)
PROCESSOR = Hardware(Sprites, CellMaps, HostAnswers, False, {"SOFTWARE": 1})


def hardware_of(ctx: moderngl.Context) -> Hardware:
    """Where a context draws."""
    return PROCESSOR if draws_in_software(ctx) else CARD
