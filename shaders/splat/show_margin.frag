#version 330 core
// Purpose: how clear the answer is: the best prompt's relevance less the second best's, or of one prompt less its
//          threshold. COVERED_ALPHA, as in the answers, is set by the program.
// Frames: texel = pixel.

#include "colormaps.glsl"
#include "luma.glsl"

uniform sampler2D colour;
uniform sampler2DArray relevance;  // PHRASES_A_LAYER each
uniform int num_prompts;
uniform float threshold;           // of the only prompt
uniform vec2 span;                 // margins shown as the first and the last colour
uniform float opacity;             // over the photo in grey; 1: alone

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 photo = texelFetch(colour, pixel, 0);
    float best = texelFetch(relevance, ivec3(pixel, 0), 0).r;
    float second = threshold;
    for (int prompt = 1; prompt < num_prompts; ++prompt) {
        float value = texelFetch(relevance, ivec3(pixel, prompt / PHRASES_A_LAYER), 0)[prompt % PHRASES_A_LAYER];
        second = prompt == 1 ? min(best, value) : max(second, min(best, value));
        best = max(best, value);
    }
    float grey = luma(clamp(photo.rgb, 0.0, 1.0));
    vec3 shade = colour_map((best - second - span.x) / (span.y - span.x));
    out_colour = vec4(photo.a >= COVERED_ALPHA ? mix(vec3(grey), shade, opacity) : vec3(0.0), 1.0);
}
