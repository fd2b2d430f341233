#version 330 core
// Purpose: relevance of four phrases out of the sums of full.frag; relevance.frag's twin.
// Frames: texel = pixel.

uniform sampler2DArray sums;    // |F|^2 and peak, then four products a layer: prompts, then negatives
uniform int layer;              // of these four prompts
uniform int first_negative;     // among all phrases
uniform int num_negatives;
uniform float temperature;      // 0: cosine mode

out vec4 out_relevance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 square = texelFetch(sums, ivec3(pixel, 0), 0).rg;
    float norm = sqrt(square.x);
    bool empty = norm * square.y < EMPTY_NORM;
    float scale = empty ? 0.0 : 1.0 / norm;
    float largest = -1.0;
    for (int i = first_negative; i < first_negative + num_negatives; ++i) {
        float product = texelFetch(sums, ivec3(pixel, 1 + i / PHRASES_A_LAYER), 0)[i % PHRASES_A_LAYER];
        largest = max(largest, min(scale * product, 1.0));
    }
    vec4 values = clamp(scale * texelFetch(sums, ivec3(pixel, layer), 0), -1.0, 1.0);
    if (temperature > 0.0) values = 1.0 / (1.0 + exp(clamp(temperature * (largest - values), -80.0, 80.0)));
    out_relevance = empty ? vec4(0.0) : values;
}
