#version 330 core
// Purpose: the colour target over a background, opaque, for a screen.

uniform sampler2D colour;  // premultiplied
uniform sampler2D depth;   // second channel: sum of T alpha, in full precision
uniform vec3 background;

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float passed = 1.0 - texelFetch(depth, pixel, 0).g;
    vec3 rgb = texelFetch(colour, pixel, 0).rgb + passed * background;
    out_colour = vec4(clamp(rgb, 0.0, 1.0), 1.0);
}
