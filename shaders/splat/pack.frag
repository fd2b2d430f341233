#version 330 core
// Purpose: ATOMS_PACKED weight maps, whole layers, to whole texels of sixteen-bit shares of the pixel's peak: a query
//          reads a third as often, and the direction of F does not depend on its length.
// Source: texel i holds atoms 8 i + c in its low and 8 i + 4 + c in its high halves, c = 0..3.
// Frames: texel = pixel.

uniform sampler2DArray weight_maps;  // three atoms + alpha a layer
uniform sampler2D peaks;             // largest weight
uniform int first_layer;             // a multiple of PACKED_LAYERS
uniform int num_layers;

const int PACKED_LAYERS = ATOMS_PACKED / ATOMS_A_LAYER;
const int TEXELS = ATOMS_PACKED / ATOMS_A_TEXEL;

layout(location = 0) out uvec4 out_texels[TEXELS];

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float peak = texelFetch(peaks, pixel, 0).r;
    float share = peak > 0.0 ? 65535.0 / peak : 0.0;
    float shares[ATOMS_PACKED];
    for (int layer = 0; layer < PACKED_LAYERS; ++layer) {
        vec3 weights = vec3(0.0);
        if (first_layer + layer < num_layers)
            weights = texelFetch(weight_maps, ivec3(pixel, first_layer + layer), 0).rgb;
        for (int atom = 0; atom < ATOMS_A_LAYER; ++atom)
            shares[ATOMS_A_LAYER * layer + atom] = clamp(share * weights[atom] + 0.5, 0.0, 65535.0);
    }
    for (int texel = 0; texel < TEXELS; ++texel)
        for (int part = 0; part < 4; ++part)
            out_texels[texel][part] = uint(shares[ATOMS_A_TEXEL * texel + part])
                                    | uint(shares[ATOMS_A_TEXEL * texel + 4 + part]) << 16u;
}
