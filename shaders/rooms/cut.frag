#version 330 core
// Purpose: furniture with panes, leaves or other holes into the G-buffer.
// Frames: world is the room's, y up, m.

#include "surface.glsl"

uniform sampler2D materials;       // two texels a row: colour + opacity; layer, gloss, 0, 0
uniform sampler2DArray textures;   // sRGB with coverage
uniform vec3 tint;
uniform float see_through;         // 1: panes are holes (windows), 0: panes are thinned

// A pane covers the centre of each 2 x 2 sample block; further samples as opacity grows.
bool thinned_away(float opacity) {
    if (opacity > 0.92) return false;
    if (see_through > 0.5 && opacity < 0.75) return true;
    ivec2 odd = ivec2(gl_FragCoord.xy) & 1;
    float need = odd == ivec2(1) ? -1.0 : (odd == ivec2(0) ? 0.3 : (odd.x == 1 ? 0.55 : 0.78));
    return opacity <= need;
}

void main() {
    vec4 colour = texelFetch(materials, ivec2(0, v_material), 0);
    vec4 more = texelFetch(materials, ivec2(1, v_material), 0);
    vec4 texel = texture(textures, vec3(v_uv, max(more.x, 0.0)));
    if (more.x >= 0.0 && texel.a < 0.4) discard;
    if (thinned_away(colour.a)) discard;
    vec3 albedo = more.x >= 0.0 ? texel.rgb : colour.rgb;
    write_surface(albedo * tint, more.y, glow * step(0.45, dot(albedo, vec3(0.333))));
}
