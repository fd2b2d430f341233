#version 330 core
// Purpose: the colour target, premultiplied, in which a background takes over where surfaces are seen from far
//          aside of all photos. Source: langflash_core/scene/trust.py, `trust`.
// Frames: camera axes are OpenCV's; `eyes` are the photos' places in those of the picture, a texel each.
//         COS_NONE and COS_FULL are set by the program.

#include "unproject.glsl"

uniform sampler2D colour;  // premultiplied
uniform vec3 background;
uniform int num_photos;
uniform sampler2D eyes;

out vec4 out_colour;

float trust(vec3 pos_c) {
    vec3 way = orthographic ? vec3(0.0, 0.0, -1.0) : -pos_c * inversesqrt(dot(pos_c, pos_c));
    float nearest = -1.0;
    for (int photo = 0; photo < num_photos; ++photo) {
        vec3 there = texelFetch(eyes, ivec2(photo, 0), 0).xyz - pos_c;
        nearest = max(nearest, dot(there, way) * inversesqrt(dot(there, there)));
    }
    return smoothstep(COS_NONE, COS_FULL, nearest);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 sums = texelFetch(depth, pixel, 0).rg;
    vec3 rgb = texelFetch(colour, pixel, 0).rgb;
    if (sums.g > 1.0 / 255.0) {
        rgb = mix(sums.g * background, rgb, trust(behind(pixel, sums.r / sums.g)));
    }
    out_colour = vec4(rgb, sums.g);
}
