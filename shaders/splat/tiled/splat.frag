#version 430 core
// Purpose: a pixel of the picture out of its tile's list, front to back, until no light passes: COLOUR, premultiplied,
//          with transmittance and depth, for films ALONE; LAYERS times three numbers that Gaussians carry; or both.
// Source: ARCHITECTURE.md, "How a splat is drawn"; tiles as in Kerbl et al. 2023.
// Frames: gl_FragCoord is the pixel centre, y down. TILE and STOP are set by the program.

#include "footprint.glsl"

layout(std430, binding = 0) readonly buffer Splats { vec4 splats[]; };  // of project.comp
layout(std430, binding = 1) readonly buffer Pairs { uvec2 pairs[]; };   // tile, row
layout(std430, binding = 2) readonly buffer Ranges { uvec2 ranges[]; };
#ifdef LAYERS
layout(std430, binding = 3) readonly buffer Weights { float weights[]; };  // 3 LAYERS a Gaussian
#endif

uniform vec2 image_size;  // pixels; the target may be larger

#ifdef COLOUR
layout(location = 0) out vec4 out_colour;
#ifndef ALONE
layout(location = 1) out vec4 out_depth;  // two channels are kept
#endif
#define BEHIND 2
#else
#define BEHIND 0
#endif
#ifdef LAYERS
layout(location = BEHIND) out vec4 out_layers[LAYERS];
#endif

uvec2 own_range() {
    if (any(greaterThan(gl_FragCoord.xy, image_size))) return uvec2(0u);
    uvec2 tile = uvec2(gl_FragCoord.xy) / uint(TILE);
    uint columns = (uint(image_size.x) + uint(TILE - 1)) / uint(TILE);
    return ranges[tile.y * columns + tile.x];
}

void main() {
    uvec2 range = own_range();
    float passed = 1.0;  // of the light
    float shown = 0.0;   // summed up, since 1 - passed has no digits where little is shown
#ifdef COLOUR
    vec4 colour_depth = vec4(0.0);
#endif
#ifdef LAYERS
    vec3 layers[LAYERS];
    for (int layer = 0; layer < LAYERS; ++layer) layers[layer] = vec3(0.0);
#endif
    for (uint place = range.x; place < range.y && passed > STOP; ++place) {
        uint row = pairs[place].y;
        vec4 centre_z = splats[4u * row + 1u];
        float alpha = splat_alpha(gl_FragCoord.xy - centre_z.xy, splats[4u * row]);
        if (!(alpha >= ALPHA_MIN)) continue;
        float share = passed * alpha;
        shown += share;
        passed *= 1.0 - alpha;
#ifdef COLOUR
        colour_depth += share * vec4(splats[4u * row + 2u].rgb, centre_z.z);
#endif
#ifdef LAYERS
        uint first = 3u * uint(LAYERS) * row;
        for (int layer = 0; layer < LAYERS; ++layer, first += 3u)
            layers[layer] += share * vec3(weights[first], weights[first + 1u], weights[first + 2u]);
#endif
    }
#ifdef COLOUR
    out_colour = vec4(colour_depth.rgb, shown);
#ifndef ALONE
    out_depth = vec4(colour_depth.a, shown, 0.0, 0.0);
#endif
#endif
#ifdef LAYERS
    for (int layer = 0; layer < LAYERS; ++layer) out_layers[layer] = vec4(layers[layer], shown);
#endif
}
