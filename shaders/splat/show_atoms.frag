#version 330 core
// Purpose: every atom its own colour, mixed as the splats mix them.

#include "combine.glsl"

out vec4 out_colour;

void main() {
    out_colour = vec4(clamp(combine(ivec2(gl_FragCoord.xy)).rgb, 0.0, 1.0), 1.0);
}
