#version 330 core
// Purpose: the largest weight at a pixel, which the packed maps are shares of.
// Frames: texel = pixel.

uniform sampler2DArray weight_maps;  // three atoms + alpha a layer
uniform int num_layers;

out float out_peak;

void main() {
    out_peak = 0.0;
    for (int layer = 0; layer < num_layers; ++layer) {
        vec3 weights = texelFetch(weight_maps, ivec3(gl_FragCoord.xy, layer), 0).rgb;
        out_peak = max(out_peak, max(weights.x, max(weights.y, weights.z)));
    }
}
