#version 330 core
// Purpose: 3 atoms + alpha per attachment, LAYERS attachments, premultiplied, drawn back to front.
// Source: W_k = sum_i T_i a_i w_ik (ARCHITECTURE.md, "Three ideas"). Frames: gl_FragCoord is the pixel centre, y down.

#include "footprint.glsl"
#include "cut.glsl"

flat in vec2 centre;
flat in vec4 whitening;
flat in vec3 weights[LAYERS];

out vec4 out_layers[LAYERS];

void main() {
    float alpha = shown_alpha(gl_FragCoord.xy - centre, whitening);
    for (int layer = 0; layer < LAYERS; ++layer) out_layers[layer] = vec4(weights[layer] * alpha, alpha);
}
