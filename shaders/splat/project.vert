#version 330 core
// Purpose: one Gaussian to its footprint and colour, written by transform feedback in draw order.
// Source: langflash_core/splat/projection.py is the twin.
// Frames: in world, out pixels. SH_DEGREE, SH_VEC4S and TINTED are set by the program.

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

#define CUT sqrt(2.0 * log(max(in_mean.w / ALPHA_MIN, 1.0)))  // where alpha falls below 1/255
#ifdef REACH  // and no further than so many deviations
#define RADIUS min(REACH, CUT)
#else
#define RADIUS CUT
#endif

const float NEAR = 0.005;  // half of what is chosen: behind it is only what a late order brings along
const float HALF_MAX = 65504.0;  // of float16: sums of T alpha c stay finite in every target

uniform mat4 viewmat;      // world to camera
uniform vec3 eye;          // camera centre, world; what float32 rounds off it is eye_rest, so that
uniform vec3 eye_rest;     // scenes far from their origin lose no digits
uniform vec4 pinhole;      // fx, fy, cx, cy in pixels; of an orthographic camera fx, fy are pixels per unit
uniform bool orthographic;
uniform vec2 image_size;   // pixels
uniform vec3 light_gain;    // the scene's colours y are shown as (y - offset) / gain
uniform vec3 light_offset;
uniform vec3 tint_colours[2];

out vec4 out_place;   // centre (pixels), opacity, z-depth
out vec4 out_shape;   // l11, l21, l22 (pixels), radius of the alpha cut in deviations
out vec3 out_colour;

void main() {
    vec3 from_eye = (in_mean.xyz - eye) - eye_rest;
    vec3 pos_c = mat3(viewmat) * from_eye;
    mat3 axes_w = rotation_of(in_quat);
    axes_w = mat3(axes_w[0] * in_scale.x, axes_w[1] * in_scale.y, axes_w[2] * in_scale.z);
    mat3 axes_c = mat3(viewmat) * axes_w;
    vec3 root = orthographic ? parallel_root(axes_c, pinhole.xy)
                             : footprint_root(pos_c, axes_c, pinhole, image_size);
    vec2 centre = pos_c.xy / (orthographic ? 1.0 : pos_c.z);
    out_place = vec4(centre * pinhole.xy + pinhole.zw, in_mean.w, pos_c.z);
    out_shape = vec4(root, RADIUS);
    if (pos_c.z < NEAR) {  // beside any image
        out_place.xy = vec2(-1e6);
        out_shape = vec4(1.0, 0.0, 1.0, 0.0);
    }
    vec3 direction = orthographic ? transpose(mat3(viewmat))[2] : normalize(from_eye);
    out_colour = clamp((sh_colour(direction) - light_offset) / light_gain, 0.0, HALF_MAX);
    int tint = int(255.0 * in_tint + 0.5);
    if (tint > 0) {
        float grey = luma(min(out_colour, 1.0));
        out_colour = mix(out_colour, tint_colours[tint - 1] * (0.35 + 0.75 * grey), TINTED);
    }
}
