// Purpose: where the surface of a pixel (unproject.glsl) lies in every photo, and what depth that photo has there.
// Frames: camera axes are OpenCV's; `pinholes` of the photos' depth maps. MAX_PHOTOS is set by the program;
//         luma.glsl is included before.

uniform sampler2D colour;
uniform sampler2DArray photo_depths;     // z, 0 where a photo shows nothing
uniform int num_photos;
uniform vec4 pinholes[MAX_PHOTOS];
uniform mat4 to_photos[MAX_PHOTOS];      // the picture's camera to a photo's

// (z of the point in this photo) / (depth of the photo there); 0 where the photo does not frame it.
float depth_ratio(vec3 pos_c, int photo) {
    vec3 seen = (to_photos[photo] * vec4(pos_c, 1.0)).xyz;
    if (seen.z <= 0.0) return 0.0;
    ivec2 texel = ivec2(floor(seen.xy / seen.z * pinholes[photo].xy + pinholes[photo].zw));
    ivec2 size = textureSize(photo_depths, 0).xy;
    if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size))) return 0.0;
    float z = texelFetch(photo_depths, ivec3(texel, photo), 0).r;
    return z > 0.0 ? seen.z / z : 0.0;
}

vec3 grey_photo(ivec2 pixel) {
    return vec3(luma(clamp(texelFetch(colour, pixel, 0).rgb, 0.0, 1.0)));
}
