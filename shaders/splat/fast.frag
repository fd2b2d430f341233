#version 330 core
// Purpose: relevance of up to four phrases, a layer of them, out of numbers that were splatted beside the colour, while
//          the camera moves.
// Source: sum T alpha g / sum T alpha |f| stands for F . (t - n) / |F|: exact where the Gaussians of a pixel say the
//         same. Number 0 is |f|, number 1 + p belongs to phrase p; a layer holds as many as atoms. EMPTY_NORM is set by
//         the program.
// Frames: texel = pixel.

uniform sampler2DArray numbers;
uniform int first_phrase;
uniform float temperature;   // 0: cosine mode

out vec4 out_relevance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float norm = texelFetch(numbers, ivec3(pixel, 0), 0).r;
    int layers = textureSize(numbers, 0).z;
    out_relevance = vec4(0.0);
    if (norm < EMPTY_NORM) return;
    for (int column = 0; column < PHRASES_A_LAYER; ++column) {
        int number = 1 + first_phrase + column;
        if (number / ATOMS_A_LAYER >= layers) break;
        float value = texelFetch(numbers, ivec3(pixel, number / ATOMS_A_LAYER), 0)[number % ATOMS_A_LAYER] / norm;
        out_relevance[column] = temperature > 0.0
            ? 1.0 / (1.0 + exp(clamp(-temperature * value, -80.0, 80.0)))
            : clamp(value, -1.0, 1.0);
    }
}
