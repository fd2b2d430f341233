#version 330 core
// Purpose: three principal axes of the pixel's feature F = W D as red, green and blue; empty pixels black.
// Source: linearity. With columns c_k, affine in d_k, and a fourth of ones, sum W_k c_k / sum W_k is affine in F / sum W_k.
// Frames: texel = pixel.

#include "combine.glsl"

uniform sampler2D peaks;

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float mixed[COLUMNS];
    combine(pixel, mixed);
    bool covered = texelFetch(peaks, pixel, 0).r * mixed[3] >= 1.0 / 255.0;
    vec3 axes = vec3(mixed[0], mixed[1], mixed[2]) / max(mixed[3], 1e-6);
    out_colour = vec4(covered ? clamp(axes, 0.0, 1.0) : vec3(0.0), 1.0);
}
