#version 330 core
// Purpose: a colour map from left to right, for colour-bars.

#include "colormaps.glsl"

uniform float width;
uniform int which_map;

out vec4 out_colour;

void main() {
    out_colour = vec4(colour_map(which_map, gl_FragCoord.x / width), 1.0);
}
