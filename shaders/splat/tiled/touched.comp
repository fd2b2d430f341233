#version 430 core
// Purpose: how many tiles each group of Gaussians touches, in the order of depth. GROUP is set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) readonly buffer Splats { uvec4 splats[]; };
layout(std430, binding = 1) readonly buffer Elements { uvec2 elements[]; };
layout(std430, binding = 2) writeonly buffer Counts { uint counts[]; };

uniform uint count;  // Gaussians in view

shared uint own;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (gl_LocalInvocationIndex == 0u) own = 0u;
    barrier();
    if (place < count) {
        uint sides = splats[4u * elements[place].y + 3u].y;
        atomicAdd(own, (sides & 65535u) * (sides >> 16u));
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) counts[gl_WorkGroupID.x] = own;
}
