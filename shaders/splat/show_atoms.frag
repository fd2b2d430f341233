#version 330 core
// Purpose: every atom its own colour, mixed as the splats mix them.

#include "combine.glsl"

uniform sampler2D peaks;

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float mixed[COLUMNS];
    combine(pixel, mixed);
    float peak = texelFetch(peaks, pixel, 0).r;
    out_colour = vec4(clamp(peak * vec3(mixed[0], mixed[1], mixed[2]), 0.0, 1.0), 1.0);
}
