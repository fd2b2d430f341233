#version 330 core
// Purpose: COLUMNS more terms of |F|^2 / peak^2 = w^T G w, added up by blending; the peak beside them. For the
//          bench: the twin of norm.frag that knows the Gram matrix G = D D^T instead of its factor R.
// Source: w^T G w = sum_j w_j (G_jj w_j + 2 sum_{k > j} G_kj w_k), so late columns skip layers, as R's do.
// Frames: texel = pixel.

#include "combine.glsl"

uniform sampler2D peaks;
uniform float with_peak;   // 1 in the first pass, 0 in the others
uniform int first_column;  // atom of column 0

out vec2 out_square_peak;

float share(ivec2 pixel, int atom) {
    uint pair = texelFetch(packed_maps, ivec3(pixel, atom / ATOMS_A_TEXEL), 0)[atom % 4];
    return float(atom % ATOMS_A_TEXEL < 4 ? pair & 65535u : pair >> 16u) / 65535.0;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float parts[COLUMNS];
    combine(pixel, parts);
    float square = 0.0;
    for (int column = 0; column < COLUMNS; ++column) square += parts[column] * share(pixel, first_column + column);
    out_square_peak = vec2(square, with_peak * texelFetch(peaks, pixel, 0).r);
}
