#version 330 core
// Purpose: a picture of half the size, for gaps: sums of 2 x 2 premultiplied texels, covered at most once.
//          FIRST: of what was drawn, with alpha in full precision.
// Source: langflash_core/scene/gaps.py, `pulled`.

uniform sampler2D colour;
#ifdef FIRST
uniform sampler2D depth;  // second channel: sum of T alpha
#endif

out vec4 out_colour;

void main() {
    ivec2 first = 2 * ivec2(gl_FragCoord.xy), size = textureSize(colour, 0);
    vec4 sum = vec4(0.0);
    for (int place = 0; place < 4; ++place) {
        ivec2 pixel = first + ivec2(place & 1, place >> 1);
        if (any(greaterThanEqual(pixel, size)))
            continue;
        vec4 own = texelFetch(colour, pixel, 0);
#ifdef FIRST
        own.a = texelFetch(depth, pixel, 0).g;
#endif
        sum += own;
    }
    out_colour = sum / max(sum.a, 1.0);
}
