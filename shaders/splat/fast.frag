#version 330 core
// Purpose: relevance of up to four phrases out of numbers that were splatted beside the colour, while the camera moves.
// Source: sum T alpha g / sum T alpha |f| stands for F . (t - n) / |F|: exact where the Gaussians of a pixel say the
//         same. Number 0 is |f|, number 1 + p belongs to phrase p; three a layer. EMPTY_NORM is set by the program.
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
    for (int column = 0; column < 4; ++column) {
        int number = 1 + first_phrase + column;
        if (number / 3 >= layers) break;
        float value = texelFetch(numbers, ivec3(pixel, number / 3), 0)[number % 3] / norm;
        out_relevance[column] = temperature > 0.0
            ? 1.0 / (1.0 + exp(clamp(-temperature * value, -80.0, 80.0)))
            : clamp(value, -1.0, 1.0);
    }
}
