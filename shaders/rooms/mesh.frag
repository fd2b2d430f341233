#version 330 core
// Purpose: opaque furniture into the G-buffer.
// Frames: world is the room's, y up, m.

#include "surface.glsl"

uniform sampler2D materials;       // two texels a row: colour + opacity; layer, gloss, 0, 0
uniform sampler2DArray textures;   // sRGB with coverage
uniform vec3 tint;

void main() {
    vec4 colour = texelFetch(materials, ivec2(0, v_material), 0);
    vec4 more = texelFetch(materials, ivec2(1, v_material), 0);
    vec3 texel = texture(textures, vec3(v_uv, max(more.x, 0.0))).rgb;
    vec3 albedo = more.x >= 0.0 ? texel : colour.rgb;
    write_surface(albedo * tint, more.y, glow * step(0.45, dot(albedo, vec3(0.333))));
}
