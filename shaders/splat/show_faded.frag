#version 330 core
// Purpose: the colour target over a background that takes over where surfaces are seen from far aside of
//          all photos, opaque, for a screen.

#include "gaps.glsl"
#include "trust.glsl"

uniform sampler2D colour;  // premultiplied
uniform sampler2D depth;   // sum of T alpha z, sum of T alpha
uniform vec3 background;

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 sums = texelFetch(depth, pixel, 0).rg;
    vec3 rgb = faded(texelFetch(colour, pixel, 0).rgb, sums, pixel, background);
    vec4 shown = over_gaps(vec4(rgb, sums.g));
    out_colour = vec4(clamp(shown.rgb + (1.0 - shown.a) * background, 0.0, 1.0), 1.0);
}
