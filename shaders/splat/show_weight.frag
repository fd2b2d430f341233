#version 330 core
// Purpose: one atom's weight map W_k in [0, 1] as a colour.
// Frames: texel = pixel.

#include "colormaps.glsl"

uniform sampler2DArray weight_maps;  // ATOMS_A_LAYER each
uniform int place;                   // of the atom among those in view

out vec4 out_colour;

void main() {
    float weight = texelFetch(weight_maps, ivec3(gl_FragCoord.xy, place / ATOMS_A_LAYER), 0)[place % ATOMS_A_LAYER];
    out_colour = vec4(colour_map(weight), 1.0);
}
