#version 330 core
// Purpose: how many photos saw what a pixel shows: none, one, several. SAME is set by the program.
// Frames: see photos.glsl.

#include "luma.glsl"
#include "unproject.glsl"
#include "photos.glsl"

uniform vec3 count_colours[3];
uniform float opacity;

out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 pos_c = surface(pixel);
    int seen = 0;
    for (int photo = 0; photo < num_photos; ++photo)
        seen += abs(depth_ratio(pos_c, photo) - 1.0) <= SAME ? 1 : 0;
    vec3 shade = mix(grey_photo(pixel), count_colours[min(seen, 2)], opacity);
    out_colour = vec4(pos_c.z > 0.0 ? shade : vec3(0.0), 1.0);
}
