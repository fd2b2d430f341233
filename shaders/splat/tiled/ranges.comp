#version 430 core
// Purpose: where each tile's pairs begin and end among the sorted ones. GROUP and EACH are set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 1) buffer Ranges { uvec2 ranges[]; };  // zeros, where a tile has none

uniform uint count;

void main() {
    for (uint round = 0u; round < uint(EACH); ++round) {
        uint place = (gl_WorkGroupID.x * uint(EACH) + round) * uint(GROUP) + gl_LocalInvocationIndex;
        if (place >= count) return;
        uint tile = pairs[place].x;
        if (place == 0u || pairs[place - 1u].x != tile) ranges[tile].x = place;
        if (place + 1u == count || pairs[place + 1u].x != tile) ranges[tile].y = place + 1u;
    }
}
