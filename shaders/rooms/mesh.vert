#version 330 core
// Purpose: furniture and walls into the G-buffer. Positions: item frame (m, y up) -> world -> clip.
// Frames: world is the room's, y up; `to_camera` gives OpenCV camera axes (+z forward).

in vec3 in_position;
in vec3 in_normal;
in vec2 in_uv;
in float in_material;

uniform mat4 model;
uniform mat4 to_camera;
uniform vec4 projection;  // 2 f / width, 2 f / height, near, far

out vec3 v_position_w;
out vec3 v_normal_w;
out vec2 v_uv;
out float v_depth;
flat out int v_material;

void main() {
    vec4 position_w = model * vec4(in_position, 1.0);
    vec3 p = (to_camera * position_w).xyz;
    v_position_w = position_w.xyz;
    v_normal_w = mat3(model) * in_normal;
    v_uv = in_uv;
    v_depth = p.z;
    v_material = int(in_material + 0.5);
    float near = projection.z, far = projection.w;
    // Image y points down, GL's up.
    gl_Position = vec4(projection.x * p.x, -projection.y * p.y,
                       (p.z * (far + near) - 2.0 * far * near) / (far - near), p.z);
}
