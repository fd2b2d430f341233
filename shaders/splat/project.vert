#version 330 core
// Purpose: one Gaussian to its footprint and colour, written by transform feedback in draw order.
// Source: project.glsl. Frames: in world, out pixels. SH_DEGREE and SH_VEC4S are set by the program.

in vec4 in_mean;   // xyz world, w opacity
in vec4 in_quat;   // wxyz, unit
in vec3 in_scale;  // standard deviations, world
in vec4 in_sh[SH_VEC4S];  // coefficients (S, 3), flat, padded to whole vec4s
in float in_tint;  // 0 none, n / 255 for colour n - 1

vec3 coefficient(int base) {
    int first = 3 * base;
    return vec3(
        in_sh[first / 4][first % 4], in_sh[(first + 1) / 4][(first + 1) % 4], in_sh[(first + 2) / 4][(first + 2) % 4]);
}

#include "footprint.glsl"
#include "harmonics.glsl"
#include "luma.glsl"
#include "project.glsl"

out vec4 out_place;   // centre (pixels), opacity, z-depth
out vec4 out_shape;   // l11, l21, l22 (pixels), radius of the alpha cut in deviations
out vec3 out_colour;

void main() {
    Projected splat = projected(in_mean, in_quat, in_scale, int(255.0 * in_tint + 0.5));
    out_place = splat.place;
    out_shape = splat.shape;
    out_colour = splat.colour;
}
