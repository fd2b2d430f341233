#version 330 core
// Purpose: light the G-buffer: hemisphere, a sun or sky through the windows and a ceiling lamp with soft
// shadows, small lamps without. Output: linear radiance.
// Frames: world (room, y up, m); camera space with OpenCV axes for rays.

uniform sampler2D albedos;
uniform sampler2D normals;
uniform sampler2D depth_id;
uniform sampler2D occlusions;      // output resolution
uniform sampler2DShadow sun_map;
uniform sampler2DShadow lamp_map;
uniform mat4 to_world;             // camera -> world
uniform vec4 lens;                 // 1 / f_x, 1 / f_y in sample units, width, height in samples
uniform mat4 to_sun;
uniform mat4 to_lamp;
uniform vec3 sun_direction;        // from the room to the sun
uniform vec3 sun_colour;
uniform vec4 lamp;                 // position, spread
uniform vec3 lamp_colour;
uniform vec3 ambient_up;
uniform vec3 ambient_down;
uniform vec3 sky_colour;
uniform vec4 points[6];            // position, reach (m); reach 0: none
uniform vec3 point_colours[6];
uniform vec4 portals[4];           // window centre, area (m2)
uniform vec3 portal_normals[4];    // into the room
uniform vec3 portal_colour;

out vec4 radiance;

float soft(sampler2DShadow map, vec4 clip, float bias, float radius) {
    vec3 p = clip.xyz / clip.w * 0.5 + 0.5;
    if (any(lessThan(p.xy, vec2(0.0))) || any(greaterThan(p.xy, vec2(1.0))) || p.z > 1.0 || clip.w < 0.0) return 1.0;
    // Four taps, turned and scaled over each 2 x 2 block: the tent filter that follows sees 16.
    ivec2 cell = ivec2(gl_FragCoord.xy) & 1;
    float angle = 0.3927 * float(cell.x + 2 * cell.y), reach = radius * (0.55 + 0.25 * float(cell.x + cell.y));
    vec2 a = reach * vec2(cos(angle), sin(angle)), b = 0.6 * vec2(-a.y, a.x);
    p.z -= bias;
    return 0.25 * (texture(map, p + vec3(a, 0.0)) + texture(map, p - vec3(a, 0.0))
                 + texture(map, p + vec3(b, 0.0)) + texture(map, p - vec3(b, 0.0)));
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec2 q = (gl_FragCoord.xy - 0.5 * lens.zw) * lens.xy;
    vec3 ray = mat3(to_world) * vec3(q.x, -q.y, 1.0);
    vec2 depth = texelFetch(depth_id, at, 0).xy;
    if (depth.y < 0.5) {
        float up = normalize(ray).y;
        vec3 land = mix(vec3(0.22, 0.28, 0.16), vec3(0.5, 0.5, 0.45), fract(sky_colour.r * 37.0));
        radiance = vec4(mix(land * sky_colour * 1.3, sky_colour * 1.8, smoothstep(-0.06, 0.05, up)), 1.0);
        return;
    }
    vec3 p = to_world[3].xyz + ray * depth.x;
    vec4 surface = texelFetch(albedos, at, 0);
    vec4 packed_normal = texelFetch(normals, at, 0);
    vec3 n = normalize(packed_normal.xyz);
    vec3 view = -normalize(ray);
    vec3 albedo = surface.rgb * (surface.rgb * (surface.rgb * 0.3053 + 0.6822) + 0.0125);  // sRGB to linear
    float open = texture(occlusions, gl_FragCoord.xy / lens.zw).r;

    vec3 light = mix(ambient_down, ambient_up, 0.5 + 0.5 * n.y) * open;
    vec3 shine = vec3(0.0);
    float power = mix(12.0, 90.0, surface.a);

    float facing = max(dot(n, sun_direction), 0.0);
    if (facing > 0.0) {
        float lit = soft(sun_map, to_sun * vec4(p + n * 0.02, 1.0), 0.0008, 0.004);
        light += sun_colour * facing * lit;
        shine += sun_colour * lit * pow(max(dot(n, normalize(view + sun_direction)), 0.0), power);
    }
    vec3 d = lamp.xyz - p;
    float near = dot(d, d);
    d *= inversesqrt(near);
    facing = max(dot(n, d), 0.0);
    if (facing > 0.0) {
        float lit = d.y > 0.12 ? soft(lamp_map, to_lamp * vec4(p + n * 0.02, 1.0), 0.0006, lamp.w) : 1.0;
        vec3 incoming = lamp_colour * lit / (0.6 + near);
        light += incoming * facing;
        shine += incoming * pow(max(dot(n, normalize(view + d)), 0.0), power);
    }
    for (int k = 0; k < 6; ++k) {
        if (points[k].w <= 0.0) break;
        vec3 e = points[k].xyz - p;
        float far = dot(e, e);
        if (far < points[k].w * points[k].w)
            light += point_colours[k] * (0.25 + 0.75 * max(dot(n, e * inversesqrt(far)), 0.0)) / (0.08 + far)
                     * (1.0 - far / (points[k].w * points[k].w)) * open;
    }
    for (int k = 0; k < 4; ++k) {
        if (portals[k].w <= 0.0) break;
        vec3 e = portals[k].xyz - p;
        float far = dot(e, e);
        e *= inversesqrt(far);
        float emitted = max(-dot(e, portal_normals[k]), 0.0);
        float received = max(0.3 + 0.7 * dot(n, e), 0.0);
        light += portal_colour * emitted * received * portals[k].w / (1.0 + 2.0 * far) * open;
    }
    float fresnel = 0.04 + 0.3 * surface.a;
    vec3 glow = albedo * packed_normal.w;
    radiance = vec4(albedo * light * mix(0.85, 1.0, open) + shine * fresnel * surface.a + glow, 1.0);
}
