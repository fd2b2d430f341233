#version 330 core
// Purpose: the share of light T = 1 - sum T alpha that passes every splat of a pixel, as a colour.
// Frames: texel = pixel.

#include "colormaps.glsl"

uniform sampler2D depth;  // second channel: sum of T alpha

out vec4 out_colour;

void main() {
    float passed = 1.0 - texelFetch(depth, ivec2(gl_FragCoord.xy), 0).g;
    out_colour = vec4(colour_map(passed), 1.0);
}
