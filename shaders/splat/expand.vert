#version 330 core
// Purpose: one Gaussian's sparse weights to the 3 * LAYERS dense weights of one pass, by transform feedback.
// Source: own. gl_VertexID is the Gaussian's row (drawn through the order as index buffer).

uniform sampler2D sparse_weights;  // (atom, weight) texels, ROW_TEXELS a row, m texels a Gaussian
uniform sampler2D slots;           // (K, 1): place of an atom among the atoms drawn, -1 if it is not
uniform int weights_per_gaussian;
uniform int first_slot;

out vec3 out_weights[LAYERS];

void main() {
    for (int layer = 0; layer < LAYERS; ++layer) out_weights[layer] = vec3(0.0);
    for (int j = 0; j < weights_per_gaussian; ++j) {
        int texel = gl_VertexID * weights_per_gaussian + j;
        vec2 pair = texelFetch(sparse_weights, ivec2(texel % ROW_TEXELS, texel / ROW_TEXELS), 0).rg;
        float slot = texelFetch(slots, ivec2(int(pair.x), 0), 0).r - float(first_slot);
        for (int layer = 0; layer < LAYERS; ++layer)
            out_weights[layer] += pair.y * vec3(equal(vec3(slot), float(ATOMS_A_LAYER * layer) + vec3(0.0, 1.0, 2.0)));
    }
}
