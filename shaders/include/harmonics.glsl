// Purpose: colour of spherical harmonics up to degree 3, not clamped; twin of langflash_core/geometry/harmonics.py.
// Source: constants and signs of Kerbl et al. 2023.
// Frames: direction from the camera to the Gaussian, world, unit. SH_DEGREE is set by the program; who includes
//         this says before where coefficients are: vec3 coefficient(int base).

vec3 sh_colour(vec3 direction) {
    vec3 colour = 0.5 + 0.28209479177387814 * coefficient(0);
#if SH_DEGREE >= 1
    float x = direction.x, y = direction.y, z = direction.z;
    colour += 0.4886025119029199 * (-y * coefficient(1) + z * coefficient(2) - x * coefficient(3));
#endif
#if SH_DEGREE >= 2
    float xx = x * x, yy = y * y, zz = z * z;
    colour += 1.0925484305920792 * (x * y * coefficient(4) - y * z * coefficient(5) - x * z * coefficient(7))
        + 0.31539156525252005 * (2.0 * zz - xx - yy) * coefficient(6)
        + 0.5462742152960396 * (xx - yy) * coefficient(8);
#endif
#if SH_DEGREE >= 3
    colour += -0.5900435899266435 * y * (3.0 * xx - yy) * coefficient(9)
        + 2.890611442640554 * x * y * z * coefficient(10)
        - 0.4570457994644658 * y * (4.0 * zz - xx - yy) * coefficient(11)
        + 0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * coefficient(12)
        - 0.4570457994644658 * x * (4.0 * zz - xx - yy) * coefficient(13)
        + 1.445305721320277 * z * (xx - yy) * coefficient(14)
        - 0.5900435899266435 * x * (xx - 3.0 * yy) * coefficient(15);
#endif
    return colour;
}
