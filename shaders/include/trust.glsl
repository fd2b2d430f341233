// Purpose: how far what a pixel shows is known from about here. Source: langflash_core/scene/trust.py, `trust`.
// Frames: camera axes are OpenCV's; `eyes` are the photos' places in those of the picture.
//         MAX_PHOTOS, COS_NONE and COS_FULL are set by the program.

uniform vec4 pinhole;      // fx, fy, cx, cy
uniform bool orthographic;
uniform int num_photos;
uniform vec3 eyes[MAX_PHOTOS];

float trust(vec3 pos_c) {
    vec3 way = orthographic ? vec3(0.0, 0.0, -1.0) : normalize(-pos_c);
    float nearest = -1.0;
    for (int photo = 0; photo < num_photos; ++photo)
        nearest = max(nearest, dot(normalize(eyes[photo] - pos_c), way));
    return smoothstep(COS_NONE, COS_FULL, nearest);
}

// rgb: premultiplied. sums: of T alpha z and of T alpha. As it is, or with `background` in place of what is not known.
vec3 faded(vec3 rgb, vec2 sums, ivec2 pixel, vec3 background) {
    if (sums.g <= 1.0 / 255.0)
        return rgb;
    float z = sums.r / sums.g;
    float known = trust(vec3((vec2(pixel) + 0.5 - pinhole.zw) / pinhole.xy * (orthographic ? 1.0 : z), z));
    return rgb * known + sums.g * (1.0 - known) * background;
}
