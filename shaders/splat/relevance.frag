#version 330 core
// Purpose: cosine of the pixel's feature with up to four phrases, or their relevancy against the best negative.
// Source: Kerr et al. 2023 (LERF); twin langflash_core/language/relevance.py. The smallest pairwise softmax is
//         the sigmoid against the largest negative.

#include "combine.glsl"

uniform sampler2D scales;    // 1 / |w R| or 0 where empty, largest cosine of the negatives
uniform float temperature;   // 0: cosine mode

out vec4 out_relevance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 scale = texelFetch(scales, pixel, 0).rg;
    float dots[COLUMNS];
    combine(pixel, dots);
    out_relevance = vec4(0.0);
    for (int column = 0; column < COLUMNS; ++column) {
        float value = clamp(scale.x * dots[column], -1.0, 1.0);
        if (temperature > 0.0) value = 1.0 / (1.0 + exp(clamp(temperature * (scale.y - value), -80.0, 80.0)));
        out_relevance[column] = scale.x > 0.0 ? value : 0.0;
    }
}
