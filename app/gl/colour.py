"""The splat pass that every picture begins with: colour and depth, in the fast mode numbers beside them."""

import moderngl
import numpy as np

from langflash_core.base.graphics import Programs, set_uniforms

from .layout import ATOMS_A_LAYER
from .splats import SplatBuffers
from .targets import PREMULTIPLIED, drawing


def draw_colour(
    programs: Programs,
    splats: SplatBuffers,
    into: moderngl.Framebuffer,
    numbers: np.ndarray | None = None,
    depth: bool = True,
) -> None:
    """Splat Gaussians, ordered and projected, into a framebuffer of the size that the projection was for, or
    into the corner of a larger one.

    Args:
        numbers: (N, 3 L), that the Gaussians carry into L layers behind colour and depth.
        depth: whether the framebuffer has it beside the colour; without, there are no numbers.
    """
    defines = {"COLOUR": 1, **splats.shapes.defines}
    num_layers = 0 if numbers is None else numbers.shape[1] // ATOMS_A_LAYER
    if not depth:
        defines["ALONE"] = 1
    if num_layers:
        defines["LAYERS"] = num_layers
    program = programs.get("quad.vert", "colour.frag", defines)
    set_uniforms(program, image_size=tuple(float(n) for n in into.size))
    into.clear()
    with drawing(into, PREMULTIPLIED):
        if len(splats.order):
            carried = None if numbers is None else splats.in_order(numbers)
            splats.draw(program, carried, num_layers)
