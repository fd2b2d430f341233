// Purpose: one Gaussian to its footprint and colour; twin of langflash_core/splat/projection.py. Needs footprint.glsl,
//          harmonics.glsl and luma.glsl.
// Frames: in world, out pixels. TINTED and, where it ends footprints, REACH are set by the program.

const float NEAR = 0.005;  // half of what is chosen: behind it is only what a late order brings along
const float HALF_MAX = 65504.0;  // of float16: sums of T alpha c stay finite in every target

uniform mat4 viewmat;      // world to camera
uniform vec3 eye;          // camera centre, world; what float32 rounds off it is eye_rest, so that
uniform vec3 eye_rest;     // scenes far from their origin lose no digits
uniform vec4 pinhole;      // fx, fy, cx, cy in pixels; of an orthographic camera fx, fy are pixels per unit
uniform bool orthographic;
uniform vec2 image_size;   // pixels
uniform vec3 light_gain;    // the scene's colours y are shown as (y - offset) / gain
uniform vec3 light_offset;
uniform vec3 tint_colours[2];

struct Projected {
    vec4 place;   // centre (pixels), opacity, z-depth
    vec4 shape;   // l11, l21, l22 (pixels), radius of the alpha cut in deviations
    vec3 colour;
};

// mean: xyz world, w opacity. quat: wxyz, unit. scale: standard deviations, world. tint: 0 none, n for colour n - 1.
Projected projected(vec4 mean, vec4 quat, vec3 scale, int tint) {
    Projected splat;
    vec3 from_eye = (mean.xyz - eye) - eye_rest;
    vec3 pos_c = mat3(viewmat) * from_eye;
    mat3 axes_w = rotation_of(quat);
    axes_w = mat3(axes_w[0] * scale.x, axes_w[1] * scale.y, axes_w[2] * scale.z);
    mat3 axes_c = mat3(viewmat) * axes_w;
    vec3 root = orthographic ? parallel_root(axes_c, pinhole.xy)
                             : footprint_root(pos_c, axes_c, pinhole, image_size);
    vec2 centre = pos_c.xy / (orthographic ? 1.0 : pos_c.z);
    float radius = sqrt(2.0 * log(max(mean.w / ALPHA_MIN, 1.0)));  // where alpha falls below 1/255
#ifdef REACH  // and no further than so many deviations
    radius = min(REACH, radius);
#endif
    splat.place = vec4(centre * pinhole.xy + pinhole.zw, mean.w, pos_c.z);
    splat.shape = vec4(root, radius);
    if (pos_c.z < NEAR) {  // beside any image
        splat.place.xy = vec2(-1e6);
        splat.shape = vec4(1.0, 0.0, 1.0, 0.0);
    }
    vec3 direction = orthographic ? transpose(mat3(viewmat))[2] : normalize(from_eye);
    splat.colour = clamp((sh_colour(direction) - light_offset) / light_gain, 0.0, HALF_MAX);
    if (tint > 0) {
        float grey = luma(min(splat.colour, 1.0));
        splat.colour = mix(splat.colour, tint_colours[tint - 1] * (0.35 + 0.75 * grey), TINTED);
    }
    return splat;
}
