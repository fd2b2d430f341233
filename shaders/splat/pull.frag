#version 330 core
// Purpose: a picture of half the size, for gaps: sums of 2 x 2 premultiplied texels, covered at most once.
//          FIRST: of what was drawn, with alpha in full precision; FADING: as show_faded.frag shows it.
// Source: langflash_core/scene/gaps.py, `pulled`.

uniform sampler2D colour;
#ifdef FIRST
uniform sampler2D depth;  // sum of T alpha z, sum of T alpha
#endif
#ifdef FADING
uniform vec3 background;
#include "trust.glsl"
#endif

out vec4 out_colour;

vec4 texel(ivec2 pixel) {
    vec4 own = texelFetch(colour, pixel, 0);
#ifdef FIRST
    vec2 sums = texelFetch(depth, pixel, 0).rg;
    own.a = sums.g;
#endif
#ifdef FADING
    own.rgb = faded(own.rgb, sums, pixel, background);
#endif
    return own;
}

void main() {
    ivec2 first = 2 * ivec2(gl_FragCoord.xy), size = textureSize(colour, 0);
    vec4 sum = vec4(0.0);
    for (int place = 0; place < 4; ++place) {
        ivec2 pixel = first + ivec2(place & 1, place >> 1);
        if (all(lessThan(pixel, size)))
            sum += texel(pixel);
    }
    out_colour = sum / max(sum.a, 1.0);
}
