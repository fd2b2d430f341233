// Purpose: what every G-buffer shader shares: inputs from mesh.vert, outputs, and value noise.
// Frames: positions and normals in world (room, y up, m); depth is z along the camera axis, m.
// One shader per look, not one with branches: software rasterisers run every branch for every pixel,
// and a shader that may discard gives up early depth tests.

in vec3 v_position_w;
in vec3 v_normal_w;
in vec2 v_uv;
in float v_depth;
flat in int v_material;

uniform vec3 eye_w;
uniform float instance_id;
uniform float glow;

layout(location = 0) out vec4 out_albedo;      // sRGB albedo, gloss
layout(location = 1) out vec4 out_normal;      // towards the eye; glow
layout(location = 2) out vec4 out_depth_id;    // z, instance id

// Models are two-sided: the normal always faces the eye.
vec3 facing_normal() {
    vec3 n = normalize(v_normal_w);
    return dot(n, eye_w - v_position_w) < 0.0 ? -n : n;
}

void write_surface(vec3 albedo, float gloss, float shine) {
    out_albedo = vec4(clamp(albedo, 0.0, 1.0), gloss);
    out_normal = vec4(facing_normal(), shine);
    out_depth_id = vec4(v_depth, instance_id, 0.0, 0.0);
}

float hash(vec2 p) {
    vec3 q = fract(vec3(p.xyx) * 0.1031);
    q += dot(q, q.yzx + 33.33);
    return fract((q.x + q.y) * q.z);
}

float noise(vec2 p) {
    vec2 cell = floor(p), f = fract(p);
    f = f * f * (3.0 - 2.0 * f);
    return mix(mix(hash(cell), hash(cell + vec2(1, 0)), f.x),
               mix(hash(cell + vec2(0, 1)), hash(cell + vec2(1, 1)), f.x), f.y);
}
