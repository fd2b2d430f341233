#version 430 core
// Purpose: one Gaussian to its footprint, its colour, the tiles that it may touch and the key that orders it by depth.
// Source: project.glsl. The box is that of quad.vert. z is a double, term by term as in `view_depths`, so that equal
//         places have equal keys; its bits grow with it.
// Frames: in world, out pixels and tiles. GROUP, TILE, SLACK, HIDDEN, SH_DEGREE and SH_VEC4S are set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) readonly buffer Means { vec4 means[]; };
layout(std430, binding = 1) readonly buffer Quats { vec4 quats[]; };
layout(std430, binding = 2) readonly buffer Scales { float scales[]; };
layout(std430, binding = 3) readonly buffer Harmonics { vec4 sh[]; };
layout(std430, binding = 4) readonly buffer Tints { uint tints[]; };  // four to a word
layout(std430, binding = 5) writeonly buffer Splats { uvec4 splats[]; };  // four each: whitening; centre and z; colour; box, its sides and the key
layout(std430, binding = 6) buffer Totals { uint num_seen; uint num_pairs; uint num_pairs_high; };

uniform uint count;        // Gaussians
uniform uvec2 grid;        // columns and rows of tiles
uniform dvec4 depth_row;   // the third row of the view matrix
uniform double nearest;    // depth

const uint KEY_BASE = 0x3F800000u;  // high word of 2^-7, below which no depth is

uint row;

vec3 coefficient(int base) {
    int first = 3 * base;
    uint own = row * uint(SH_VEC4S);
    return vec3(sh[own + first / 4][first % 4], sh[own + (first + 1) / 4][(first + 1) % 4],
                sh[own + (first + 2) / 4][(first + 2) % 4]);
}

#include "footprint.glsl"
#include "harmonics.glsl"
#include "luma.glsl"
#include "project.glsl"

shared uint own_seen, own_pairs;

// Columns and rows before which the box begins and ends; none where it is broken or beside the image.
uvec4 tiles_of(vec2 centre, vec2 extent) {
    if (any(isnan(centre + extent)) || any(isinf(centre))) return uvec4(0u);
    vec2 low = centre - extent, high = centre + extent;
    if (any(lessThan(high, vec2(0.0))) || any(greaterThan(low, image_size))) return uvec4(0u);
    vec2 last = vec2(grid) - 1.0;
    return uvec4(clamp(floor(low / float(TILE)), vec2(0.0), last),
                 clamp(floor(high / float(TILE)), vec2(0.0), last) + 1.0);
}

uint put() {
    uint tint = (tints[row / 4u] >> (8u * (row % 4u))) & 255u;
    vec4 mean = means[row];
    precise double z = double(mean.x) * depth_row.x + double(mean.y) * depth_row.y + double(mean.z) * depth_row.z
                     + depth_row.w;
    vec3 scale = vec3(scales[3u * row], scales[3u * row + 1u], scales[3u * row + 2u]);
    Projected splat = projected(mean, quats[row], scale, tint == uint(HIDDEN) ? 0 : int(tint));
    vec4 shape = splat.shape;
    vec2 extent = (shape.w + SLACK) * vec2(shape.x, length(shape.yz));
    uvec4 box = tint == uint(HIDDEN) || !(z >= nearest) ? uvec4(0u) : tiles_of(splat.place.xy, extent);
    uvec2 sides = box.zw - box.xy;
    uint touched = sides.x * sides.y;
    uvec2 key = touched > 0u ? unpackDouble2x32(z) - uvec2(0u, KEY_BASE) : uvec2(~0u, ~0u >> 4u);
    splats[4u * row] = floatBitsToUint(vec4(1.0 / shape.x, shape.y, 1.0 / shape.z, splat.place.z));
    splats[4u * row + 1u] = floatBitsToUint(vec4(splat.place.xyw, 0.0));
    splats[4u * row + 2u] = floatBitsToUint(vec4(splat.colour, 0.0));
    splats[4u * row + 3u] = uvec4(box.x | box.y << 16u, sides.x | sides.y << 16u, key);
    return touched;
}

void main() {
    row = gl_GlobalInvocationID.x;
    if (gl_LocalInvocationIndex == 0u) own_seen = own_pairs = 0u;
    barrier();
    uint touched = row < count ? put() : 0u;
    if (touched > 0u) {
        atomicAdd(own_seen, 1u);
        atomicAdd(own_pairs, touched);
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        atomicAdd(num_seen, own_seen);
        uint before = atomicAdd(num_pairs, own_pairs);
        if (before + own_pairs < before) atomicAdd(num_pairs_high, 1u);
    }
}
