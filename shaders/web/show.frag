#version 300 es
// Purpose: what was splatted on the page's canvas: colours over the background, or a phrase glowing over them.
// Source: `heat_over` of langflash_core/export/png.py; relevance as in splat/fast.frag.
// Frames: row 0 of the splatted part is its top, row 0 of the canvas its bottom. GLOW, DIM, STOPS, HEAT_STOPS and
//         EMPTY_NORM are set by the page.

precision highp float;

#include "glow.glsl"
#include "luma.glsl"

uniform sampler2D colours;   // premultiplied
uniform sampler2D numbers;   // |f| and f . t less that of the best negative
uniform vec2 part;           // share of the textures that was drawn
uniform vec2 canvas_size;    // pixels
uniform vec3 background;
uniform float threshold;     // above 1: no phrase
uniform float temperature;

out vec4 out_colour;

vec3 heat(float value) {
    const vec3 stops[STOPS] = vec3[STOPS](HEAT_STOPS);
    float place = clamp(value, 0.0, 1.0) * float(STOPS - 1);
    int lower = min(int(place), STOPS - 2);
    return mix(stops[lower], stops[lower + 1], place - float(lower));
}

void main() {
    vec2 place = gl_FragCoord.xy / canvas_size;
    vec2 at = part * vec2(place.x, 1.0 - place.y);
    vec4 texel = texture(colours, at);
    vec3 view = clamp(texel.rgb + (1.0 - texel.a) * background, 0.0, 1.0);
    if (threshold <= 1.0) {
        vec2 sums = texture(numbers, at).rg;
        float value = sums.x < EMPTY_NORM ? 0.0 : 1.0 / (1.0 + exp(-temperature * sums.y / sums.x));
        float neutral = min(0.5, threshold - 0.02);
        float glow = clamp((value - 0.5 * (neutral + threshold)) / (threshold - neutral), 0.0, 1.0);
        float grey = luma(view);
        vec3 colour = heat(0.4 + 0.6 * (value - threshold) / max(1.0 - threshold, 1e-6));
        vec3 lit = mix(view, colour, glow_share(grey, GLOW));
        view = mix(DIM * (0.7 * vec3(grey) + 0.3 * view), lit, glow);
    }
    out_colour = vec4(view, 1.0);
}
