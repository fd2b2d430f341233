#version 430 core
// Purpose: what is to be sorted: one half of each Gaussian's depth key, and its row.
// Frames: none. GROUP is set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) readonly buffer Splats { uvec4 splats[]; };
layout(std430, binding = 1) buffer Elements { uvec2 elements[]; };

uniform uint count;
uniform bool fresh;   // in the order of the rows; else in that which is there
uniform int half_of;  // 0 the low word, 1 the high one

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (place >= count) return;
    uint row = fresh ? place : elements[place].y;
    elements[place] = uvec2(splats[4u * row + 3u][2 + half_of], row);
}
