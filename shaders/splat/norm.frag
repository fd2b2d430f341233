#version 330 core
// Purpose: COLUMNS more components of |F|^2 / peak^2 = |w R|^2, added up by blending; the peak beside them.
// Source: D = R Q with orthonormal Q (ARCHITECTURE.md, "Three ideas"); R is made triangular, so late columns
//         skip layers.
// Frames: texel = pixel.

#include "combine.glsl"

uniform sampler2D peaks;
uniform float with_peak;   // 1 in the first pass, 0 in the others

out vec2 out_square_peak;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float parts[COLUMNS];
    combine(pixel, parts);
    float square = 0.0;
    for (int column = 0; column < COLUMNS; ++column) square += parts[column] * parts[column];
    out_square_peak = vec2(square, with_peak * texelFetch(peaks, pixel, 0).r);
}
