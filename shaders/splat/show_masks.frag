#version 330 core
// Purpose: the pixels whose best passing prompt reaches its own threshold: as flat colours, alone, left out, or undimmed.
//          COVERED_ALPHA, as in the answers, and MAX_PROMPTS are set by the program.
// Frames: texel = pixel.

#include "gaps.glsl"
#include "luma.glsl"

uniform sampler2D colour;          // premultiplied
uniform sampler2D depth;           // second channel: sum of T alpha, in full precision
uniform sampler2DArray relevance;  // PHRASES_A_LAYER each
uniform int num_prompts;
uniform int style;                 // 0 flat colours, 1 only these, 2 without these, 3 the rest dimmed
uniform vec3 background;
uniform float thresholds[MAX_PROMPTS];
uniform vec3 label_colours[MAX_PROMPTS];

out vec4 out_colour;

const float DIMMED = 0.3;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float alpha = texelFetch(depth, pixel, 0).g;
    float best = 0.0;
    int label = -1;
    for (int prompt = 0; prompt < num_prompts; ++prompt) {
        float value = texelFetch(relevance, ivec3(pixel, prompt / PHRASES_A_LAYER), 0)[prompt % PHRASES_A_LAYER];
        bool passes = value >= thresholds[prompt] && alpha >= COVERED_ALPHA;
        if (passes && (label < 0 || value > best)) {
            best = value;
            label = prompt;
        }
    }
    vec4 photo = over_gaps(vec4(texelFetch(colour, pixel, 0).rgb, alpha));
    vec3 rgb = clamp(photo.rgb + (1.0 - photo.a) * background, 0.0, 1.0);
    float grey = luma(rgb);
    bool shown = label >= 0;
    if (style == 0) rgb = shown ? label_colours[max(label, 0)] : background;
    if (style == 1) rgb = shown ? rgb : background;
    if (style == 2) rgb = shown ? background : rgb;
    if (style == 3) rgb = shown ? rgb : DIMMED * mix(rgb, vec3(grey), 0.7);
    out_colour = vec4(rgb, 1.0);
}
