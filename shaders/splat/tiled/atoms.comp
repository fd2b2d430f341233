#version 430 core
// Purpose: which atoms the Gaussians in view carry. GROUP is set by the program.

layout(local_size_x = GROUP) in;

layout(std430, binding = 0) readonly buffer Splats { uvec4 splats[]; };
layout(std430, binding = 1) readonly buffer Carried { uint carried[]; };  // a bit an atom, `words` a Gaussian
layout(std430, binding = 2) coherent buffer Seen { uint seen[]; };

uniform uint count;
uniform uint words;

void main() {
    uint row = gl_GlobalInvocationID.x;
    if (row >= count || splats[4u * row + 3u].y == 0u) return;
    for (uint word = 0u; word < words; ++word) {
        uint own = carried[row * words + word];
        if ((own & ~seen[word]) != 0u) atomicOr(seen[word], own);
    }
}
