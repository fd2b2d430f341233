#version 430 core
// Purpose: elements to their places by one digit of their keys; those of the same digit keep their order.
// Source: radix sort; a thread has EACH elements in a row. GROUP, EACH and DIGITS are set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) readonly buffer From { uvec2 from[]; };
layout(std430, binding = 1) readonly buffer Counts { uint counts[]; };  // sums of those before, of digits.comp
layout(std430, binding = 2) writeonly buffer Into { uvec2 into[]; };

uniform uint count;
uniform int shift;

#include "scanned.glsl"

shared uint before[DIGITS * GROUP];  // elements of each digit that threads before have
shared uint starts[DIGITS];

uint digit_of(uvec2 element) {
    return (element.x >> shift) & uint(DIGITS - 1);
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint first = gl_WorkGroupID.x * uint(GROUP * EACH) + thread * uint(EACH);
    uint some = first < count ? min(uint(EACH), count - first) : 0u;
    for (uint digit = 0u; digit < uint(DIGITS); ++digit) before[digit * uint(GROUP) + thread] = 0u;
    for (uint round = 0u; round < some; ++round) ++before[digit_of(from[first + round]) * uint(GROUP) + thread];
    barrier();
    uint run = thread * uint(DIGITS), sum = 0u;  // as many to sum up as there are digits
    for (uint step = 0u; step < uint(DIGITS); ++step) sum += before[run + step];
    uint total = scanned(sum) - sum;
    for (uint step = 0u; step < uint(DIGITS); ++step) {
        uint here = before[run + step];
        before[run + step] = total;
        total += here;
    }
    barrier();
    if (thread < uint(DIGITS))
        starts[thread] = counts[thread * gl_NumWorkGroups.x + gl_WorkGroupID.x] - before[thread * uint(GROUP)];
    barrier();
    for (uint round = 0u; round < some; ++round) {
        uvec2 element = from[first + round];
        uint digit = digit_of(element);
        into[starts[digit] + before[digit * uint(GROUP) + thread]++] = element;
    }
}
