#version 330 core
// Purpose: one instanced quad per footprint, the smallest sheared square around the alpha cut; where MARGIN is set one
//          point sprite instead, the smallest upright square, into a viewport so many pixels wider on every side.
// Source: the image under L of the square around the circle |u| = sqrt(2 ln(255 o)); its area is that of the
//         box along the ellipse's axes, without an eigen-decomposition.
// Frames: pixels to clip space; row 0 of the target is the top of the image, so nothing is flipped.

in vec4 in_place;
in vec4 in_shape;
#ifdef LAYERS
in vec3 in_weights[LAYERS];
flat out vec3 weights[LAYERS];
#endif
#ifdef COLOUR
in vec3 in_colour;
flat out vec4 colour_depth;
#endif

uniform vec2 image_size;

flat out vec2 centre;
flat out vec4 whitening;

const float SLACK = 0.02;  // deviations: above the rasteriser's snapping (1/256 px) for the thinnest footprint

void main() {
    float radius = in_shape.w + SLACK;
    vec2 extent = radius * vec2(in_shape.x, length(in_shape.yz));
#ifdef MARGIN
    gl_PointSize = 2.0 * max(extent.x, extent.y);
    vec2 pos_px = in_place.xy, viewport = image_size + 2.0 * MARGIN;
#else
    vec2 corner = 2.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1) - 1.0;
    vec2 spread = radius * corner, viewport = image_size;
    vec2 pos_px = in_place.xy + vec2(in_shape.x * spread.x, in_shape.y * spread.x + in_shape.z * spread.y);
    if (any(greaterThan(extent, image_size))) {  // a sheared quad this large loses digits: its box on the image
        pos_px = clamp(in_place.xy + extent * corner, vec2(-1.0), image_size + 1.0);
    }
#endif
    centre = in_place.xy;
    whitening = vec4(1.0 / in_shape.x, in_shape.y, 1.0 / in_shape.z, in_place.z);
    bool broken = any(isnan(pos_px + extent)) || any(isinf(pos_px));
    gl_Position = broken ? vec4(2.0, 2.0, 2.0, 1.0) : vec4((2.0 * pos_px - image_size) / viewport, 0.0, 1.0);
#ifdef LAYERS
    for (int layer = 0; layer < LAYERS; ++layer) weights[layer] = in_weights[layer];
#endif
#ifdef COLOUR
    colour_depth = vec4(in_colour, in_place.w);
#endif
}
