#version 430 core
// Purpose: counts to the sums of those before, by one work group. GROUP is set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) buffer Counts { uint counts[]; };

uniform uint count;

#include "scanned.glsl"

void main() {
    uint each = (count + uint(GROUP - 1)) / uint(GROUP);
    uint first = min(gl_LocalInvocationIndex * each, count), last = min(first + each, count);
    uint own = 0u;
    for (uint place = first; place < last; ++place) own += counts[place];
    uint before = scanned(own) - own;
    for (uint place = first; place < last; ++place) {
        uint here = counts[place];
        counts[place] = before;
        before += here;
    }
}
