#version 330 core
// Purpose: screen-space ambient occlusion at output resolution, 1 = open.
// Frames: camera space, OpenCV axes; depth is z in m. Source: the Alchemy estimator (McGuire et al. 2011).

uniform sampler2D depth_id;   // 2 W + 1 by 2 H + 1 samples; odd ones are pixel centres
uniform sampler2D normals;    // world
uniform mat4 to_camera;
uniform vec4 lens;            // 1 / f_x, 1 / f_y in sample units, width, height in samples

out float occlusion;

const int TAPS = 9;
const float RADIUS = 0.45;    // m

vec3 position_c(ivec2 at) {
    float z = texelFetch(depth_id, at, 0).x;
    vec2 q = (vec2(at) + 0.5 - 0.5 * lens.zw) * lens.xy;
    return vec3(q.x * z, -q.y * z, z);       // rows count upwards in GL, y points down in the camera
}

void main() {
    ivec2 at = 2 * ivec2(gl_FragCoord.xy) + 1;
    vec3 p = position_c(at);
    occlusion = 1.0;
    if (p.z <= 0.0) return;
    vec3 n = normalize(mat3(to_camera) * texelFetch(normals, at, 0).xyz);
    float reach = min(RADIUS / (p.z * lens.x), 0.25 * lens.w);
    ivec2 cell = ivec2(gl_FragCoord.xy) & 3;
    float spin = 6.2832 * float((cell.x * 5 + cell.y * 7) & 15) / 16.0;
    float sum = 0.0;
    for (int k = 0; k < TAPS; ++k) {
        float r = (float(k) + 0.6) / float(TAPS);
        float angle = spin + 2.4 * float(k);
        ivec2 there = clamp(at + ivec2(r * reach * vec2(cos(angle), sin(angle))), ivec2(0), ivec2(lens.zw) - 1);
        vec3 d = position_c(there) - p;
        if (d.z < -p.z * 0.999) continue;     // nothing there: sky
        sum += max(dot(d, n) - 0.01 * p.z, 0.0) / (dot(d, d) + 0.02);
    }
    occlusion = clamp(1.0 - 0.28 * sum / float(TAPS) * 4.0 * RADIUS, 0.15, 1.0);
}
