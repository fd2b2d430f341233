#version 330 core
// Purpose: 4 * BLOCKS more components of |F|^2 = |W R|^2, added up by blending.
// Source: D = R Q with orthonormal Q, blueprint section 1; R is made triangular, so late columns skip layers.
// Frames: texel = pixel. One fetch of a layer serves all components of the pass.

uniform sampler2DArray weight_maps;
uniform mat3x4 columns[BLOCKS * MAX_LAYERS];  // block by block, as in combine.glsl
uniform int first_layer;
uniform int num_layers;

out float out_square;

void main() {
    vec4 parts[BLOCKS];
    for (int block = 0; block < BLOCKS; ++block) parts[block] = vec4(0.0);
    for (int layer = first_layer; layer < num_layers; ++layer) {
        vec3 weights = texelFetch(weight_maps, ivec3(gl_FragCoord.xy, layer), 0).rgb;
        for (int block = 0; block < BLOCKS; ++block)
            parts[block] += columns[block * MAX_LAYERS + layer] * weights;
    }
    out_square = 0.0;
    for (int block = 0; block < BLOCKS; ++block) out_square += dot(parts[block], parts[block]);
}
