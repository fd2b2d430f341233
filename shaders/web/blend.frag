#version 300 es
// Purpose: one picture of those of PARTS layers of a scene: colours, and LAYERS times three numbers. OVER: each over the
//         next one, for moving pictures; else blended, as splat/blend.frag has it.
// Source: langflash_core/splat/compose.py: S_i = A_i sum_j w_j A_j exp(-(ln(z_i / z_j) / DEPTH)^2) supports layer i, and
//         b_i ~ w_i A_i (S_i / max S)^4, in sum 1, raised until sum_i b_i A_i is
//         max_i A_i min(1, w_i A_i / (CLOSES sum_j w_j A_j)). DEPTH, CLOSES is set by the page.
// Frames: texel = pixel. Depth is of the mean place that a picture shows, as that of its Gaussians is.

precision highp float;
precision highp sampler2DArray;

#include "footprint.glsl"

uniform sampler2DArray pictures;  // STRIDE of each part: colour, numbers, and where not OVER the place from its photo's
uniform vec2 parts[PARTS];        // w_i, and how far its photo's place lies ahead of the camera
uniform vec3 forward;             // the camera's axis in the world

layout(location = 0) out vec4 out_texels[LAYERS + 1];

float shares[PARTS];

vec4 texel_of(int part, int place) {
    return texelFetch(pictures, ivec3(gl_FragCoord.xy, part * STRIDE + place), 0);
}

vec4 shared_texel(int place) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < PARTS; ++i) sum += shares[i] * texel_of(i, place);
    return sum;
}

void share() {
#if OVER
    float passes = 1.0;
    for (int i = 0; i < PARTS; ++i) {
        shares[i] = passes;
        passes *= 1.0 - texel_of(i, 0).a;
    }
#else
    float alphas[PARTS];
    float logs[PARTS];
    for (int i = 0; i < PARTS; ++i) {
        vec4 place = texel_of(i, STRIDE - 1);
        alphas[i] = place.a;
        float depth = dot(forward, place.xyz) / max(place.a, ALPHA_MIN) + parts[i].y;
        logs[i] = log(place.a >= ALPHA_MIN ? max(depth, 1e-9) : 1e-9);
    }
    float support[PARTS];
    float best = 1e-30;
    for (int i = 0; i < PARTS; ++i) {
        support[i] = 0.0;
        for (int j = 0; j < PARTS; ++j) {
            float apart = (logs[i] - logs[j]) / DEPTH;
            support[i] += parts[j].x * alphas[j] * exp(-apart * apart);
        }
        support[i] *= alphas[i];
        best = max(best, support[i]);
    }
    float sum = 0.0;
    float all = 0.0;
    for (int i = 0; i < PARTS; ++i) {
        float ratio = support[i] / best;
        ratio *= ratio;
        shares[i] = parts[i].x * alphas[i] * ratio * ratio;
        sum += shares[i];
        all += parts[i].x * alphas[i];
    }
    float closed = 0.0;
    float shown = 0.0;
    for (int i = 0; i < PARTS; ++i) {
        shares[i] /= max(sum, 1e-30);
        closed = max(closed, alphas[i] * min(1.0, parts[i].x * alphas[i] / max(CLOSES * all, 1e-30)));
        shown += shares[i] * alphas[i];
    }
    for (int i = 0; i < PARTS; ++i) shares[i] *= max(closed / max(shown, 1e-30), 1.0);
#endif
}

void main() {
    share();
    out_texels[0] = shared_texel(0);
#if LAYERS > 0  // outputs take constant indices only
    out_texels[1] = shared_texel(1);
#endif
#if LAYERS > 1
    out_texels[2] = shared_texel(2);
#endif
}
