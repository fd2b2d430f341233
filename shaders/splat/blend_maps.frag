#version 330 core
// Purpose: what one layer of a scene adds to weight maps, LAYERS of their array at once: its own ones times what it
//          counts in the pixel.
// Source: W = sum_i b_i W_i (langflash_core/splat/compose.py); added to what is there by the blending.
// Frames: texel = pixel.

uniform sampler2DArray maps;  // three atoms + alpha a texture
uniform sampler2D shares;     // b_i, by blend.frag
uniform int part;             // i
uniform int first_layer;

out vec4 out_layers[LAYERS];

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float share = texelFetch(shares, pixel, 0)[part];
    for (int layer = 0; layer < LAYERS; ++layer)
        out_layers[layer] = share * texelFetch(maps, ivec3(pixel, first_layer + layer), 0);
}
