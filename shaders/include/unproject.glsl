// Purpose: where the surface that a pixel shows lies.
// Frames: camera axes are OpenCV's; texel = pixel, `pinhole` in pixels. COVERED_ALPHA is set by the program.

uniform sampler2D depth;       // of the picture: sum of T alpha z, sum of T alpha
uniform vec4 pinhole;          // fx, fy, cx, cy
uniform bool orthographic;

// What lies at depth z behind the middle of a pixel, in camera axes.
vec3 behind(ivec2 pixel, float z) {
    return vec3((vec2(pixel) + 0.5 - pinhole.zw) / pinhole.xy * (orthographic ? 1.0 : z), z);
}

// The pixel's surface in camera axes; z = 0 where the picture shows none.
vec3 surface(ivec2 pixel) {
    vec2 sums = texelFetch(depth, pixel, 0).rg;
    return sums.y < COVERED_ALPHA ? vec3(0.0) : behind(pixel, sums.x / sums.y);
}
