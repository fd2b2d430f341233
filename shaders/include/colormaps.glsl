// Purpose: perceptual colour maps as polynomials of t in [0, 1].
// Source: own least-squares fits, degree 7, of the published turbo and inferno tables (largest error 0.05, mean 0.01).

vec3 turbo(float t) {
    vec3 colour = vec3(-307.3828, -26.1930, -197.4319);
    colour = colour * t + vec3(1021.4667, 69.8329, 801.9358);
    colour = colour * t + vec3(-1267.3622, -58.5784, -1262.1501);
    colour = colour * t + vec3(696.1427, 17.8028, 952.3053);
    colour = colour * t + vec3(-144.6806, -6.3213, -332.2824);
    colour = colour * t + vec3(-0.0821, 0.6547, 32.8694);
    colour = colour * t + vec3(2.1640, 2.7450, 4.5165);
    colour = colour * t + vec3(0.1619, 0.0760, 0.2728);
    return clamp(colour, 0.0, 1.0);
}

vec3 inferno(float t) {
    vec3 colour = vec3(0.8020, 47.6763, -211.2568);
    colour = colour * t + vec3(22.1276, -179.0641, 716.2761);
    colour = colour * t + vec3(-66.9610, 263.3877, -949.5274);
    colour = colour * t + vec3(73.9996, -193.4416, 627.0707);
    colour = colour * t + vec3(-40.5123, 75.4552, -212.4104);
    colour = colour * t + vec3(11.3998, -14.3182, 29.6916);
    colour = colour * t + vec3(0.1195, 1.3228, 0.7676);
    colour = colour * t + vec3(0.0004, -0.0113, 0.0196);
    return clamp(colour, 0.0, 1.0);
}

// which: 0 turbo, 1 inferno, 2 grey
vec3 colour_map(int which, float t) {
    t = clamp(t, 0.0, 1.0);
    return which == 0 ? turbo(t) : which == 1 ? inferno(t) : vec3(t);
}
