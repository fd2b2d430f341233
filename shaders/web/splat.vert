#version 300 es
// Purpose: one quad per Gaussian of a web page, with its colour and what it carries for phrases. An instance is BATCH
//         quads: one quad an instance is slow in many browsers.
// Source: splat/project.vert and splat/quad.vert in one; the Gaussian's numbers come out of textures.
// Frames: in world, out clip space; row 0 of the target is the top of the image. BATCH, SH_DEGREE and LAYERS are
//         set by the page.

precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;

uniform usampler2D order;      // rows of the Gaussians, in draw order
uniform int count;             // of them
uniform sampler2D gaussians;   // mean and opacity; quaternion wxyz; scales and row of the palette; f_dc
uniform sampler2D palette;     // harmonics above degree 0, (S - 1) texels an entry
uniform sampler2D numbers;     // LAYERS texels a Gaussian: three numbers for phrases each
uniform mat3 turn;             // world to camera
uniform vec3 eye;              // world
uniform vec4 pinhole;          // fx, fy, cx, cy in pixels
uniform vec2 image_size;       // pixels
uniform vec3 light_gain;       // the scene's colours y are shown as (y - offset) / gain
uniform vec3 light_offset;

flat out vec2 centre;
flat out vec4 whitening;
flat out vec3 colour;
#if LAYERS > 0
flat out vec3 carried[LAYERS];
#endif

const float SLACK = 0.02;  // deviations, as in splat/quad.vert
const int BASES = (SH_DEGREE + 1) * (SH_DEGREE + 1);

vec4 texel_of(sampler2D table, int index) {
    int width = textureSize(table, 0).x;
    return texelFetch(table, ivec2(index % width, index / width), 0);
}

int entry;
vec3 plain;

vec3 coefficient(int base) {
    return base == 0 ? plain : texel_of(palette, entry * (BASES - 1) + base - 1).rgb;
}

#include "footprint.glsl"
#include "harmonics.glsl"

void main() {
    int place = gl_InstanceID * BATCH + (gl_VertexID >> 2);
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // beside the image
    if (place >= count) return;
    int order_width = textureSize(order, 0).x;
    int row = int(texelFetch(order, ivec2(place % order_width, place / order_width), 0).r);
    int first = 4 * row;
    vec4 mean = texel_of(gaussians, first);
    vec4 scale = texel_of(gaussians, first + 2);
    vec3 from_eye = mean.xyz - eye;
    vec3 pos_c = turn * from_eye;
    mat3 axes_w = rotation_of(texel_of(gaussians, first + 1));
    axes_w = mat3(axes_w[0] * scale.x, axes_w[1] * scale.y, axes_w[2] * scale.z);
    vec3 root = footprint_root(pos_c, turn * axes_w, pinhole, image_size);
    entry = int(scale.w);
    plain = texel_of(gaussians, first + 3).rgb;
    colour = max((sh_colour(normalize(from_eye)) - light_offset) / light_gain, 0.0);

    centre = pos_c.xy / pos_c.z * pinhole.xy + pinhole.zw;
    whitening = vec4(1.0 / root.x, root.y, 1.0 / root.z, mean.w);
    float radius = sqrt(2.0 * log(max(mean.w / ALPHA_MIN, 1.0))) + SLACK;
    vec2 corner = 2.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1 & 1) - 1.0;
    vec2 spread = radius * corner;
    vec2 pos_px = centre + vec2(root.x * spread.x, root.y * spread.x + root.z * spread.y);
    vec2 extent = radius * vec2(root.x, length(root.yz));
    if (any(greaterThan(extent, image_size))) {  // a sheared quad this large loses digits: its box on the image
        pos_px = clamp(centre + extent * corner, vec2(-1.0), image_size + 1.0);
    }
    gl_Position = vec4(2.0 * pos_px / image_size - 1.0, 0.0, 1.0);
#if LAYERS > 0
    for (int layer = 0; layer < LAYERS; ++layer) carried[layer] = texel_of(numbers, row * LAYERS + layer).rgb;
#endif
}
