#version 330 core
// Purpose: COLUMNS more channels of F / peak = w D, all C of them formed: their squares, and their products with four
//          phrases a layer, added up by blending. For the bench: what a query costs without the factorisation D = R Q.
// Frames: texel = pixel.

#include "combine.glsl"

uniform vec4 phrases[COLUMNS * GROUPS];  // [channel][group of four phrases]
uniform sampler2D peaks;
uniform float with_peak;   // 1 in the first pass, 0 in the others

out vec4 out_sums[1 + GROUPS];  // |F|^2 and peak, then four products each

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float channels[COLUMNS];
    combine(pixel, channels);
    for (int group = 0; group <= GROUPS; ++group) out_sums[group] = vec4(0.0);
    for (int channel = 0; channel < COLUMNS; ++channel) {
        out_sums[0].x += channels[channel] * channels[channel];
        for (int group = 0; group < GROUPS; ++group)
            out_sums[1 + group] += channels[channel] * phrases[channel * GROUPS + group];
    }
    out_sums[0].y = with_peak * texelFetch(peaks, pixel, 0).r;
}
