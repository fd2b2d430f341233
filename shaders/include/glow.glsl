// How much of a heat colour covers a photo: all of it where the photo is dark and has nothing to show, `least` where
// it is white. `glow_share` of langflash_core/export/png.py, in shaders.

float glow_share(float grey, float least) {
    float dark = 1.0 - grey;
    return mix(least, 1.0, dark * dark);
}
