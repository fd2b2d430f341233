#version 330 core
// Purpose: one prompt's relevance as a heat-map, alone or over the dimmed photo colours.
//          COVERED_ALPHA, as in the answers, is set by the program.

#include "colormaps.glsl"
#include "gaps.glsl"
#include "glow.glsl"
#include "luma.glsl"

uniform sampler2D colour;
uniform sampler2DArray relevance;  // PHRASES_A_LAYER each
uniform int prompt;
uniform float threshold;
uniform vec2 span;                 // relevance shown as the first and the last colour
uniform float opacity;             // of the heat where the photo is white; 1: alone

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float value = texelFetch(relevance, ivec3(pixel, prompt / PHRASES_A_LAYER), 0)[prompt % PHRASES_A_LAYER];
    vec4 photo = texelFetch(colour, pixel, 0);
    vec3 rgb = clamp(over_gaps(photo).rgb, 0.0, 1.0);
    vec3 heat = colour_map((value - span.x) / max(span.y - span.x, 1e-6));
    float grey = luma(rgb);
    vec3 under = mix(rgb, vec3(0.5 * grey), opacity < 1.0 ? 0.6 : 1.0);
    vec3 over = mix(rgb, heat, glow_share(grey, opacity));
    bool shown = value >= threshold && photo.a >= COVERED_ALPHA;
    vec3 hidden = opacity < 1.0 ? under : vec3(0.0);
    out_colour = vec4(shown ? over : hidden, 1.0);
}
