#version 330 core
// Purpose: the coarser picture, to be drawn behind the one that is there. Source: langflash_core/scene/gaps.py, `pushed`.

#define GAPS
#include "gaps.glsl"

out vec4 out_colour;

void main() {
    out_colour = over_gaps(vec4(0.0));
}
