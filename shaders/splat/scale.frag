#version 330 core
// Purpose: what every phrase is compared with at a pixel: 1 / |w R|, 0 where F is empty, and the largest cosine of
//          the negatives; MAX blending goes over groups of COLUMNS.
// Source: twin langflash_core/language/relevance.py. EMPTY_NORM is set by the program.

#include "combine.glsl"

uniform sampler2D squares;  // |w R|^2, peak

out vec2 out_scale;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 square = texelFetch(squares, pixel, 0).rg;
    float norm = sqrt(square.x);
    float scale = norm * square.y < EMPTY_NORM ? 0.0 : 1.0 / norm;
    float dots[COLUMNS];
    combine(pixel, dots);
    float largest = -1.0;
    for (int column = 0; column < COLUMNS; ++column) largest = max(largest, min(scale * dots[column], 1.0));
    out_scale = vec2(scale, largest);
}
