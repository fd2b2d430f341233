"""How atoms and phrases lie in textures: the one place that says so. Shaders receive it as `DEFINES`.

Weight maps: three atoms a layer, in red, green and blue beside the alpha that drives the blending;
eight layers, the colour attachments every OpenGL 3.3 has, so 24 atoms a pass.
Packed maps: eight atoms a texel, as sixteen-bit halves of four numbers.
Relevance: four phrases a layer.
"""

import math

from langflash_core.base.colormaps import NUM_STOPS

ATOMS_A_LAYER = 3
LAYERS_A_PASS = 8
ATOMS_A_PASS = ATOMS_A_LAYER * LAYERS_A_PASS
ATOMS_A_TEXEL = 8
ATOMS_PACKED = math.lcm(ATOMS_A_LAYER, ATOMS_A_TEXEL)  # at once: whole layers to whole texels
PHRASES_A_LAYER = 4

DEFINES = {
    "STOPS": NUM_STOPS,
    "ATOMS_A_LAYER": ATOMS_A_LAYER,
    "ATOMS_A_TEXEL": ATOMS_A_TEXEL,
    "ATOMS_PACKED": ATOMS_PACKED,
    "PHRASES_A_LAYER": PHRASES_A_LAYER,
}


def num_layers(num_atoms: int) -> int:
    """Layers that so many weight maps, or numbers of the fast mode, fill."""
    return -(-num_atoms // ATOMS_A_LAYER)


def num_groups(num_phrases: int) -> int:
    """Layers that the relevance of so many phrases fills, at least one."""
    return max(1, -(-num_phrases // PHRASES_A_LAYER))
