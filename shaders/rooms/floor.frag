#version 330 core
// Purpose: the floor into the G-buffer: planks, tiles or carpet from world coordinates.
// Frames: world is the room's, y up, m.

#include "surface.glsl"

#include "tiles.glsl"

uniform vec3 floor_colour;
uniform vec3 floor_accent;
uniform vec4 floor_style;          // kind (0 planks, 1 tiles, 2 carpet), width (m), length (m), turned (0, 1)

vec3 planks(vec2 p) {
    float row = floor(p.y / floor_style.y);
    vec2 at = vec2(p.x + hash(vec2(row, 3.7)) * floor_style.z, p.y);
    vec2 board = vec2(floor(at.x / floor_style.z), row);
    float tone = hash(board + 17.0);
    float grain = noise(vec2(at.x * 3.0 + tone * 40.0, at.y * 55.0)) - 0.5;
    vec2 edge = abs(fract(at / floor_style.zy) - 0.5) * floor_style.zy;
    float gap = min(floor_style.z * 0.5 - edge.x, floor_style.y * 0.5 - edge.y);
    vec3 colour = mix(floor_colour, floor_accent, 0.7 * tone) * (1.0 + 0.22 * grain);
    return colour * mix(0.62, 1.0, smoothstep(0.0, 0.004 + 0.0012 * v_depth, gap));
}

vec3 floor_look(vec2 p) {
    p = floor_style.w > 0.5 ? p.yx : p;
    if (floor_style.x < 0.5) return planks(p);
    if (floor_style.x < 1.5) return tiles(p, floor_colour, floor_accent, floor_style.yy, 1.0);
    float pile = noise(p * 160.0) * 0.5 + noise(p * 23.0) * 0.5;
    return mix(floor_colour, floor_accent, 0.35 * noise(p * 2.0)) * (0.82 + 0.36 * pile);
}

void main() {
    write_surface(floor_look(v_position_w.xz), floor_style.x < 1.5 ? 0.25 : 0.0, 0.0);
}
