"""Pictures that are gone in a moment, where OpenGL runs on the processor; at rest still.py draws them."""

from functools import partial

import moderngl

from ..renderer import SplatRenderer
from ..splats import SplatBuffers

REACH = 2.5
"""Deviations at which footprints end. Where alpha falls below 1/255 an opaque one ends at 3.3."""


def moving_renderer(ctx: moderngl.Context) -> SplatRenderer:
    """Colours in three quarters of the time, at about 54 dB against footprints that end at alpha 1/255.

    Every fragment that is not drawn is time won there, and float32 colours cost less than float16, which the
    processor has to convert; weight maps are large and stay in float16.
    """
    return SplatRenderer(ctx, "float32", splats=partial(SplatBuffers, reach=REACH), maps="float16")
