#version 330 core
// Purpose: one picture of those of LAYERS layers of a scene: colour, depth, and what each layer counts in the pixel.
// Source: langflash_core/splat/compose.py: S_i = A_i sum_j w_j A_j exp(-(ln(z_i / z_j) / DEPTH)^2) supports layer i, and
//         b_i ~ w_i A_i (S_i / max S)^4, in sum 1, raised until sum_i b_i A_i is
//         max_i A_i min(1, w_i A_i / (CLOSES sum_j w_j A_j)). DEPTH, CLOSES and ALPHA_MIN are set by the program.
// Frames: texel = pixel.

uniform sampler2D colour_0, colour_1, colour_2, colour_3;  // premultiplied
uniform sampler2D depth_0, depth_1, depth_2, depth_3;      // sum of T alpha z, sum of T alpha
uniform vec4 weights;                                      // w_i
uniform bool halved;                                       // all but the first lie in half the sides in the corner

#include "halved.glsl"

layout(location = 0) out vec4 out_colour;
layout(location = 1) out vec4 out_depth;  // two channels are kept
layout(location = 2) out vec4 out_shares;

vec4 farther(sampler2D layer, ivec2 pixel) {
    if (!halved) return texelFetch(layer, pixel, 0);
    ivec4 at = halved_texels(pixel, textureSize(layer, 0));
    vec2 share = halved_shares(pixel);
    return mix(mix(texelFetch(layer, at.xy, 0), texelFetch(layer, at.zy, 0), share.x),
               mix(texelFetch(layer, at.xw, 0), texelFetch(layer, at.zw, 0), share.x), share.y);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 colours[4];
    vec2 depths[4];
    colours[0] = texelFetch(colour_0, pixel, 0);
    depths[0] = texelFetch(depth_0, pixel, 0).rg;
    colours[1] = farther(colour_1, pixel);
    depths[1] = farther(depth_1, pixel).rg;
#if LAYERS > 2
    colours[2] = farther(colour_2, pixel);
    depths[2] = farther(depth_2, pixel).rg;
    colours[3] = farther(colour_3, pixel);
    depths[3] = farther(depth_3, pixel).rg;
#endif
    float counts[LAYERS];
    float logs[LAYERS];
    for (int i = 0; i < LAYERS; ++i) {
        float alpha = depths[i].y;
        counts[i] = weights[i] * alpha;
        logs[i] = log(alpha >= ALPHA_MIN ? max(depths[i].x / alpha, 1e-9) : 1e-9);
    }
    float support[LAYERS];
    float best = 1e-30;
    for (int i = 0; i < LAYERS; ++i) {
        support[i] = 0.0;
        for (int j = 0; j < LAYERS; ++j) {
            float apart = (logs[i] - logs[j]) / DEPTH;
            support[i] += counts[j] * exp(-apart * apart);
        }
        support[i] *= depths[i].y;
        best = max(best, support[i]);
    }
    float sum = 0.0;
    float all = 0.0;
    float shares[4];
    for (int i = 0; i < 4; ++i) shares[i] = 0.0;
    for (int i = 0; i < LAYERS; ++i) {
        float ratio = support[i] / best;
        ratio *= ratio;
        shares[i] = counts[i] * ratio * ratio;
        sum += shares[i];
        all += counts[i];
    }
    float closed = 0.0;
    float shown = 0.0;
    for (int i = 0; i < LAYERS; ++i) {
        shares[i] /= max(sum, 1e-30);
        closed = max(closed, depths[i].y * min(1.0, counts[i] / max(CLOSES * all, 1e-30)));
        shown += shares[i] * depths[i].y;
    }
    float raised = max(closed / max(shown, 1e-30), 1.0);
    out_colour = vec4(0.0);
    vec2 depth = vec2(0.0);
    for (int i = 0; i < LAYERS; ++i) {
        shares[i] *= raised;
        out_colour += shares[i] * colours[i];
        depth += shares[i] * depths[i];
    }
    out_depth = vec4(depth, 0.0, 0.0);
    out_shares = vec4(shares[0], shares[1], shares[2], shares[3]);
}
