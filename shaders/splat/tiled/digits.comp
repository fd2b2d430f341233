#version 430 core
// Purpose: how often each digit of the keys is in each block of EACH elements a thread.
// Source: radix sort, four bits a pass. GROUP, EACH and DIGITS are set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) readonly buffer From { uvec2 from[]; };  // key, value
layout(std430, binding = 1) writeonly buffer Counts { uint counts[]; };  // digit by digit, block by block

uniform uint count;
uniform int shift;

shared uint own[DIGITS];

void main() {
    uint thread = gl_LocalInvocationIndex, first = gl_WorkGroupID.x * uint(GROUP * EACH);
    if (thread < uint(DIGITS)) own[thread] = 0u;
    barrier();
    for (uint round = 0u; round < uint(EACH); ++round) {
        uint place = first + round * uint(GROUP) + thread;
        if (place < count) atomicAdd(own[(from[place].x >> shift) & uint(DIGITS - 1)], 1u);
    }
    barrier();
    if (thread < uint(DIGITS)) counts[thread * gl_NumWorkGroups.x + gl_WorkGroupID.x] = own[thread];
}
