#version 330 core
// Purpose: walls into the G-buffer: paint, stripes, wainscot or tiles from world coordinates.
// Frames: world is the room's, y up, m.

#include "surface.glsl"

#include "tiles.glsl"

uniform vec3 wall_colour;
uniform vec3 wall_accent;
uniform vec4 wall_style;           // kind (0 plain, 1 stripes, 2 wainscot, 3 half tiles), width (m), skirting (m), 0

vec3 wall_look(vec3 p, vec3 n) {
    vec2 q = vec2(abs(n.x) > 0.5 ? p.z : p.x, p.y);
    if (q.y < wall_style.z) return vec3(0.86, 0.85, 0.82);
    vec3 colour = wall_colour * (0.985 + 0.03 * noise(q * 14.0));
    if (wall_style.x > 2.5 && q.y < 1.5) return tiles(q, wall_accent, wall_accent, wall_style.yy, 0.0);
    if (wall_style.x > 1.5 && wall_style.x < 2.5 && q.y < 0.95) return q.y > 0.91 ? vec3(0.88) : wall_accent;
    if (wall_style.x > 0.5 && wall_style.x < 1.5) {
        float s = abs(fract(q.x / wall_style.y) - 0.5) * 2.0;
        colour = mix(colour, wall_accent, smoothstep(0.45, 0.55, s));
    }
    return colour;
}

void main() {
    write_surface(wall_look(v_position_w, v_normal_w), 0.0, 0.0);
}
