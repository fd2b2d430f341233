// Purpose: sum_k W_k(p) a_k for four columns a at once, out of the weight-map array (3 atoms a layer).
// Source: linearity of compositing, blueprint section 1. MAX_LAYERS is set by the program.
// Frames: texel = pixel, row 0 = top of the image.

uniform sampler2DArray weight_maps;
uniform mat3x4 columns[MAX_LAYERS];  // [layer][atom in layer] -> four values
uniform int first_layer;
uniform int num_layers;

vec4 combine(ivec2 pixel) {
    vec4 total = vec4(0.0);
    for (int layer = first_layer; layer < num_layers; ++layer)
        total += columns[layer] * texelFetch(weight_maps, ivec3(pixel, layer), 0).rgb;
    return total;
}
