#version 330 core
// Purpose: cosine of the pixel's feature with four phrases, or their relevancy against the best negative.
// Source: Kerr et al. 2023 (LERF); twin langflash_core/query/relevance.py. The smallest pairwise softmax is
//         the sigmoid against the largest negative. EMPTY_NORM is set by the program.

#include "combine.glsl"

uniform sampler2D square_norms;  // |F|^2
uniform sampler2D negatives;     // largest cosine over the negatives
uniform float temperature;       // 0: cosine mode

#ifdef LARGEST
out float out_largest;           // of four phrases; MAX blending goes over the groups
#else
out vec4 out_relevance;
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float norm = sqrt(texelFetch(square_norms, pixel, 0).r);
    bool empty = norm < EMPTY_NORM;
    vec4 cosines = empty ? vec4(0.0) : clamp(combine(pixel) / norm, -1.0, 1.0);
#ifdef LARGEST
    out_largest = max(max(cosines.x, cosines.y), max(cosines.z, cosines.w));
#else
    if (temperature > 0.0) {
        float negative = texelFetch(negatives, pixel, 0).r;
        cosines = 1.0 / (1.0 + exp(clamp(temperature * (negative - cosines), -80.0, 80.0)));
    }
    out_relevance = empty ? vec4(0.0) : cosines;
#endif
}
