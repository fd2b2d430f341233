#version 430 core
// Purpose: a pair (tile, row) for each tile that each Gaussian touches, in the order of depth; a group's threads share
//          its pairs, so that a Gaussian over the whole picture is not one thread's.
// Frames: tiles, row 0 at the top. GROUP is set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) readonly buffer Splats { uvec4 splats[]; };
layout(std430, binding = 1) readonly buffer Elements { uvec2 elements[]; };
layout(std430, binding = 2) readonly buffer Counts { uint counts[]; };  // pairs of the groups before
layout(std430, binding = 3) writeonly buffer Pairs { uvec2 pairs[]; };

uniform uint count;    // Gaussians in view
uniform uint columns;  // of tiles

#include "scanned.glsl"

shared uint rows[GROUP];
shared uvec2 boxes[GROUP];

void main() {
    uint thread = gl_LocalInvocationIndex, place = gl_GlobalInvocationID.x;
    rows[thread] = place < count ? elements[place].y : 0u;
    boxes[thread] = place < count ? splats[4u * rows[thread] + 3u].xy : uvec2(0u);
    scanned((boxes[thread].y & 65535u) * (boxes[thread].y >> 16u));
    uint total = sums[GROUP - 1], first = counts[gl_WorkGroupID.x];
    for (uint pair = thread; pair < total; pair += uint(GROUP)) {
        uint who = 0u;  // the first whose sum is above
        for (uint reach = uint(GROUP / 2); reach > 0u; reach /= 2u)
            if (sums[who + reach - 1u] <= pair) who += reach;
        uint local = pair - (who > 0u ? sums[who - 1u] : 0u);
        uvec2 box = boxes[who];
        uint wide = box.y & 65535u;
        uint tile = ((box.x >> 16u) + local / wide) * columns + (box.x & 65535u) + local % wide;
        pairs[first + pair] = uvec2(tile, rows[who]);
    }
}
