// Purpose: sum_k w_k(p) a_k for COLUMNS columns a at once, w = W / peak out of the packed weight maps.
// Source: linearity of compositing (ARCHITECTURE.md, "Three ideas"); `pack.frag` wrote the maps, eight atoms a
//         texel.
//         LAYERS is a constant, so that the loop unrolls and every uniform has a fixed place.
// Frames: texel = pixel, row 0 = top of the image.

uniform usampler2DArray packed_maps;
uniform vec4 columns[2 * LAYERS * COLUMNS];  // [layer][low, high half][column], of 65535ths
uniform int first_layer;

void combine(ivec2 pixel, out float totals[COLUMNS]) {
    for (int column = 0; column < COLUMNS; ++column) totals[column] = 0.0;
    for (int layer = 0; layer < LAYERS; ++layer) {
        uvec4 texel = texelFetch(packed_maps, ivec3(pixel, first_layer + layer), 0);
        vec4 low = vec4(ivec4(texel & 65535u)), high = vec4(ivec4(texel >> 16u));
        for (int column = 0; column < COLUMNS; ++column)
            totals[column] += dot(columns[2 * layer * COLUMNS + column], low)
                            + dot(columns[(2 * layer + 1) * COLUMNS + column], high);
    }
}
