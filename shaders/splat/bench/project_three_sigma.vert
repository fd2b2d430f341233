#version 330 core
// Purpose: project.vert with every footprint cut at three deviations, whatever its opacity. For the bench.
// Source: the cut of Kerbl et al. 2023; langflash_core/splat/projection.py for the rest.
// Frames: in world, out pixels.

#include "footprint.glsl"
#include "harmonics.glsl"

in vec4 in_mean;
in vec4 in_quat;
in vec3 in_scale;

const float HALF_MAX = 65504.0;
const float CUT = 3.0;

uniform mat4 viewmat;
uniform vec3 eye;
uniform vec3 eye_rest;
uniform vec4 pinhole;
uniform vec2 image_size;

out vec4 out_place;
out vec4 out_shape;
out vec3 out_colour;

void main() {
    vec3 from_eye = (in_mean.xyz - eye) - eye_rest;
    vec3 pos_c = mat3(viewmat) * from_eye;
    mat3 axes_w = rotation_of(in_quat);
    axes_w = mat3(axes_w[0] * in_scale.x, axes_w[1] * in_scale.y, axes_w[2] * in_scale.z);
    vec3 root = footprint_root(pos_c, mat3(viewmat) * axes_w, pinhole, image_size);
    out_place = vec4(pos_c.xy / pos_c.z * pinhole.xy + pinhole.zw, in_mean.w, pos_c.z);
    out_shape = vec4(root, CUT);
    out_colour = min(sh_colour(normalize(from_eye)), HALF_MAX);
}
