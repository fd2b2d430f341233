// Purpose: a 3D Gaussian's footprint on the image, as its Cholesky factor; twin of langflash_core/splat/projection.py.
// Source: Zwicker et al. 2001 (EWA splatting); constants of Kerbl et al. 2023.
// Frames: means in world, offsets in pixels (y down, centre of the first pixel at 0.5).

const float DILATION = 0.3;     // pixels^2 on both axes
const float TAN_MARGIN = 0.3;   // how far the Jacobian's direction may leave the image, in half sizes
const float ALPHA_MAX = 0.99;
const float ALPHA_MIN = 1.0 / 255.0;

mat3 rotation_of(vec4 q) {  // unit
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

// (l11, l21, l22) of S = A A^T + 0.3 I of the rows of A. Cauchy-Binet keeps det S a sum of positive terms.
vec3 root_of(vec3 top, vec3 bottom) {
    vec3 minors = cross(top, bottom);
    float var_x = dot(top, top) + DILATION;
    float var_y = dot(bottom, bottom) + DILATION;
    float det = dot(minors, minors) + DILATION * (var_x + var_y - DILATION);
    float l11 = sqrt(var_x);
    return vec3(l11, dot(top, bottom) / l11, sqrt(det / var_x));
}

// Of parallel rays: the same at every place, and exact. `focal` in pixels per unit.
vec3 parallel_root(mat3 axes_c, vec2 focal) {
    mat3 rows = transpose(axes_c);
    return root_of(focal.x * rows[0], focal.y * rows[1]);
}

vec3 footprint_root(vec3 pos_c, mat3 axes_c, vec4 pinhole, vec2 size) {
    vec2 focal = pinhole.xy, principal = pinhole.zw;
    vec2 margin = TAN_MARGIN * 0.5 * size / focal;
    vec2 slope = clamp(pos_c.xy / pos_c.z, -principal / focal - margin, (size - principal) / focal + margin);
    mat3 rows = transpose(axes_c) / pos_c.z;
    vec3 top = focal.x * (rows * vec3(1.0, 0.0, -slope.x));
    vec3 bottom = focal.y * (rows * vec3(0.0, 1.0, -slope.y));
    return root_of(top, bottom);
}

// whitening holds 1 / l11, l21, 1 / l22, opacity.
float splat_alpha(vec2 offset_px, vec4 whitening) {
    float u = offset_px.x * whitening.x;
    float v = (offset_px.y - whitening.y * u) * whitening.z;
    return min(ALPHA_MAX, whitening.w * exp(-0.5 * (u * u + v * v)));
}
