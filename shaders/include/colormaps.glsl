// Purpose: a colour map of t in [0, 1], linear between evenly spaced stops.
// Source: langflash_core/base/colormaps.py, which also draws files with them; STOPS is set by the program.

uniform vec3 colour_stops[STOPS];

vec3 colour_map(float t) {
    float place = clamp(t, 0.0, 1.0) * float(STOPS - 1);
    int lower = min(int(place), STOPS - 2);
    return mix(colour_stops[lower], colour_stops[lower + 1], place - float(lower));
}
