"""Pure functions on rotations, cameras, and spherical harmonics."""
