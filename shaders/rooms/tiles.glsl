// Purpose: square tiles with grout; needs surface.glsl. Lengths in m.

vec3 tiles(vec2 p, vec3 base, vec3 accent, vec2 size, float checker) {
    vec2 tile = floor(p / size);
    vec2 edge = (0.5 - abs(fract(p / size) - 0.5)) * size;
    float odd = mod(tile.x + tile.y, 2.0) * checker;
    vec3 colour = mix(base, accent, odd) * (0.96 + 0.08 * hash(tile) + 0.06 * (noise(p * 9.0) - 0.5));
    float grout = smoothstep(0.002, 0.005 + 0.001 * v_depth, min(edge.x, edge.y));
    return mix(vec3(0.62), colour, grout);
}
