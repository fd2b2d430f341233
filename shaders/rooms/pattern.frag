#version 330 core
// Purpose: pictures, rugs, cloth and mirrors into the G-buffer; patterns come from texture coordinates and a seed.
// Frames: world is the room's, y up, m.

#include "surface.glsl"

uniform sampler2D materials;       // two texels a row: colour + opacity; layer, gloss, kind, 0
uniform vec3 tint;
uniform float seed;
uniform vec3 wall_colour;
uniform vec3 floor_colour;
uniform vec3 ceiling_colour;

const int ART = 1, RUG = 2, FABRIC = 3, MIRROR = 4;

vec3 palette(float t) {
    return 0.5 + 0.4 * cos(6.2832 * (t + vec3(0.0, 0.33, 0.67) * (0.3 + 0.7 * fract(seed * 7.13))));
}

vec3 art_look(vec2 uv) {
    float style = floor(fract(seed * 13.7) * 3.0);
    vec2 margin = min(uv, 1.0 - uv);
    if (min(margin.x, margin.y) < 0.16 && fract(seed * 5.3) > 0.5) return vec3(0.92, 0.91, 0.88);
    if (style < 0.5) {                                   // a landscape: sky over layered hills
        vec3 colour = mix(palette(0.1 + seed), vec3(0.9), uv.y);
        for (int k = 3; k > 0; --k) {
            float ridge = 0.18 * float(k) + 0.16 * noise(vec2(uv.x * (2.0 + float(k)) + seed * 31.0, float(k)));
            if (uv.y < ridge) colour = mix(palette(seed + 0.13 * float(k)), vec3(0.25, 0.32, 0.25), 0.5);
        }
        return colour;
    }
    if (style < 1.5) {                                   // coloured fields
        vec2 cell = floor(uv * (2.0 + floor(fract(seed * 3.1) * 3.0)));
        return mix(palette(hash(cell + seed * 91.0)), vec3(0.9, 0.88, 0.8), step(0.6, hash(cell + 9.0)));
    }
    float disc = length(uv - vec2(0.3 + 0.4 * fract(seed * 9.1), 0.55));
    vec3 ground = mix(vec3(0.9, 0.87, 0.8), palette(seed), step(uv.y, 0.35));
    return mix(palette(seed + 0.4), ground, smoothstep(0.22, 0.225, disc)) * (0.9 + 0.2 * noise(uv * 30.0));
}

vec3 rug_look(vec2 uv, vec3 base) {
    vec2 margin = min(uv, 1.0 - uv);
    float border = min(margin.x, margin.y);
    vec3 second = mix(base, palette(seed + 0.5), 0.65), third = mix(base, palette(seed + 0.2), 0.6) * 0.7;
    float style = fract(seed * 17.3);
    vec3 colour = base;
    if (style > 0.66) {
        colour = mix(base, second, step(0.5, fract(uv.y * 7.0)));
    } else if (style > 0.33) {
        vec2 q = abs(fract(uv * vec2(6.0, 4.0)) - 0.5);
        colour = mix(second, mix(base, third, step(q.x + q.y, 0.22)), step(q.x + q.y, 0.42));
    }
    if (border < 0.08 && style < 0.66) colour = border > 0.03 && border < 0.05 ? third : second;
    return colour * (0.88 + 0.24 * noise(uv * 190.0));
}

vec3 fabric_look(vec2 uv, vec3 base) {
    float style = fract(seed * 11.9);
    vec3 second = mix(base, palette(seed + 0.3), 0.5);
    if (style > 0.75) base = mix(base, second, step(0.5, fract(uv.x * 8.0)));
    else if (style > 0.55) base = mix(base, second, step(length(fract(uv * 6.0) - 0.5), 0.24));
    return base * (0.93 + 0.14 * noise(uv * 120.0));
}

// A room that is not really there: the colours of wall, floor and ceiling in the reflected direction.
vec3 mirror_look() {
    vec3 bounced = reflect(normalize(v_position_w - eye_w), facing_normal());
    vec3 look = mix(wall_colour * 0.75, bounced.y > 0.25 ? ceiling_colour : wall_colour, 0.5 + 0.5 * bounced.x);
    return mix(look, floor_colour, smoothstep(-0.15, -0.45, bounced.y)) * 0.9;
}

void main() {
    vec4 colour = texelFetch(materials, ivec2(0, v_material), 0);
    vec4 more = texelFetch(materials, ivec2(1, v_material), 0);
    int kind = int(more.z + 0.5);
    vec3 albedo = colour.rgb * tint;
    if (kind == ART) albedo = art_look(v_uv);
    else if (kind == RUG) albedo = rug_look(v_uv, albedo);
    else if (kind == FABRIC) albedo = fabric_look(v_uv, albedo);
    else if (kind == MIRROR) albedo = mirror_look();
    write_surface(albedo, kind == MIRROR ? 0.9 : more.y, 0.0);
}
