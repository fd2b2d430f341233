#version 330 core
// Purpose: z-depth as a colour, linear in 1/z so that near things keep contrast; empty pixels black.

#include "colormaps.glsl"

uniform sampler2D depth;      // sum of T alpha z, sum of T alpha
uniform vec2 depth_range;     // nearest, farthest, scene units

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 sums = texelFetch(depth, pixel, 0).rg;
    float alpha = sums.y;
    float z = max(sums.x / max(alpha, 1e-6), 1e-9);
    float t = (1.0 / z - 1.0 / depth_range.y) / max(1.0 / depth_range.x - 1.0 / depth_range.y, 1e-9);
    out_colour = vec4(alpha < 1.0 / 255.0 ? vec3(0.0) : colour_map(t), 1.0);
}
