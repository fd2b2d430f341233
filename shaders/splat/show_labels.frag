#version 330 core
// Purpose: the prompt with the highest relevance, as a colour over the dimmed photo; below the threshold, none.

#include "gaps.glsl"

uniform sampler2D colour;
uniform sampler2DArray relevance;
uniform int num_prompts;
uniform float threshold;
uniform float opacity;
uniform vec3 label_colours[MAX_PROMPTS];

layout(location = 0) out vec4 out_colour;
layout(location = 1) out float out_label;  // 0 none, 1 + prompt

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 photo = texelFetch(colour, pixel, 0);
    float best = threshold;
    int label = -1;
    for (int prompt = 0; prompt < num_prompts; ++prompt) {
        float value = texelFetch(relevance, ivec3(pixel, prompt / PHRASES_A_LAYER), 0)[prompt % PHRASES_A_LAYER];
        bool higher = label < 0 ? value >= best : value > best;
        if (higher && photo.a >= COVERED_ALPHA) {
            best = value;
            label = prompt;
        }
    }
    vec3 rgb = clamp(over_gaps(photo).rgb, 0.0, 1.0);
    out_colour = vec4(label < 0 ? 0.4 * rgb : mix(rgb, label_colours[max(label, 0)], opacity), 1.0);
    out_label = float(label + 1);
}
