#version 330 core
// Purpose: how far the depths of the photos that see a pixel's surface lie apart from it, at worst; grey where fewer
//          than two can tell. WORST is set by the program: a photo in which the point lies farther behind its
//          surface than this does not see it.
// Frames: see photos.glsl; here every photo's depth is of its own Gaussians alone.

#include "colormaps.glsl"
#include "luma.glsl"
#include "unproject.glsl"
#include "photos.glsl"

uniform float opacity;

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 pos_c = surface(pixel);
    int seen = 0;
    float worst = 0.0;
    for (int photo = 0; photo < num_photos; ++photo) {
        float ratio = depth_ratio(pos_c, photo);
        if (ratio <= 0.0 || ratio > 1.0 + WORST) continue;
        seen += 1;
        worst = max(worst, abs(ratio - 1.0));
    }
    vec3 grey = grey_photo(pixel);
    vec3 shade = mix(grey, colour_map(worst / WORST), opacity);
    out_colour = vec4(pos_c.z > 0.0 ? (seen < 2 ? 0.5 * grey : shade) : vec3(0.0), 1.0);
}
