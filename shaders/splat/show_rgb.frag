#version 330 core
// Purpose: the colour target over a background, opaque, for a screen.

#include "gaps.glsl"

uniform sampler2D colour;  // premultiplied
uniform sampler2D depth;   // second channel: sum of T alpha, in full precision
uniform vec3 background;

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 shown = over_gaps(vec4(texelFetch(colour, pixel, 0).rgb, texelFetch(depth, pixel, 0).g));
    out_colour = vec4(clamp(shown.rgb + (1.0 - shown.a) * background, 0.0, 1.0), 1.0);
}
