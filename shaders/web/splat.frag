#version 300 es
// Purpose: colour of one splat, and LAYERS times three numbers that it carries, at most nine, premultiplied, drawn
//         back to front.
// Source: twin of splat/colour.frag. Frames: gl_FragCoord is the pixel centre, y down.

precision highp float;

#include "footprint.glsl"

flat in vec2 centre;
flat in vec4 whitening;
flat in vec3 colour;
#if LAYERS > 0
flat in vec3 carried[LAYERS];
#endif

layout(location = 0) out vec4 out_texels[LAYERS + 1];

void main() {
    float alpha = splat_alpha(gl_FragCoord.xy - centre, whitening);
    if (alpha < ALPHA_MIN) discard;
    out_texels[0] = vec4(colour * alpha, alpha);
#if LAYERS > 0  // outputs take constant indices only
    out_texels[1] = vec4(carried[0] * alpha, alpha);
#endif
#if LAYERS > 1
    out_texels[2] = vec4(carried[1] * alpha, alpha);
#endif
#if LAYERS > 2
    out_texels[3] = vec4(carried[2] * alpha, alpha);
#endif
}
