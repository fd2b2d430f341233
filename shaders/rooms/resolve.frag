#version 330 core
// Purpose: 2 x samples to pixels. A 3 x 3 tent around the odd sample that is the pixel's centre, so that
// colour stays aligned with depth and ids, which are that sample itself. Values are clipped before the mean.

uniform sampler2D radiance;
uniform sampler2D depth_id;

layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 centre;   // z (m), id

void main() {
    ivec2 at = 2 * ivec2(gl_FragCoord.xy) + 1;
    vec3 sum = vec3(0.0);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
            sum += min(texelFetch(radiance, at + ivec2(x, y), 0).rgb, vec3(4.0)) * float((2 - abs(x)) * (2 - abs(y)));
    colour = vec4(sum / 16.0, 1.0);
    centre = texelFetch(depth_id, at, 0);
}
