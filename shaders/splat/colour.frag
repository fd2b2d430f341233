#version 330 core
// Purpose: colour, transmittance and depth of one splat, premultiplied, drawn back to front; in the fast mode also
//          LAYERS times three numbers that it carries; for films the colour ALONE.
// Source: ARCHITECTURE.md, "How a splat is drawn". Frames: gl_FragCoord is the pixel centre, y down.

#include "footprint.glsl"
#include "cut.glsl"

flat in vec2 centre;
flat in vec4 whitening;
flat in vec4 colour_depth;
#ifdef LAYERS
flat in vec3 weights[LAYERS];
#endif

layout(location = 0) out vec4 out_colour;
#ifndef ALONE
layout(location = 1) out vec4 out_depth;  // two channels are kept; alpha drives the blending
#endif
#ifdef LAYERS
layout(location = 2) out vec4 out_layers[LAYERS];
#endif

void main() {
    float alpha = shown_alpha(gl_FragCoord.xy - centre, whitening);
    out_colour = vec4(colour_depth.rgb * alpha, alpha);
#ifndef ALONE
    out_depth = vec4(colour_depth.a * alpha, alpha, 0.0, alpha);
#endif
#ifdef LAYERS
    for (int layer = 0; layer < LAYERS; ++layer) out_layers[layer] = vec4(weights[layer] * alpha, alpha);
#endif
}
