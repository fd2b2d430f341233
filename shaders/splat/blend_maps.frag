#version 330 core
// Purpose: what one layer of a scene adds to weight maps, LAYERS of their array at once: its own ones times what it
//          counts in the pixel.
// Source: W = sum_i b_i W_i (langflash_core/splat/compose.py); added to what is there by the blending.
// Frames: texel = pixel.

uniform sampler2DArray maps;  // three atoms + alpha a texture
uniform sampler2D shares;     // b_i, by blend.frag
uniform int part;             // i
uniform int first_layer;
uniform bool halved;          // the maps lie in half the sides in the corner

#include "halved.glsl"

out vec4 out_layers[LAYERS];

vec4 shown(ivec2 pixel, int layer) {
    if (!halved) return texelFetch(maps, ivec3(pixel, layer), 0);
    ivec4 at = halved_texels(pixel, textureSize(maps, 0).xy);
    vec2 share = halved_shares(pixel);
    return mix(mix(texelFetch(maps, ivec3(at.xy, layer), 0), texelFetch(maps, ivec3(at.zy, layer), 0), share.x),
               mix(texelFetch(maps, ivec3(at.xw, layer), 0), texelFetch(maps, ivec3(at.zw, layer), 0), share.x), share.y);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float share = texelFetch(shares, pixel, 0)[part];
    for (int layer = 0; layer < LAYERS; ++layer)
        out_layers[layer] = share * shown(pixel, first_layer + layer);
}
