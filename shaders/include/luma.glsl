// Brightness of a colour: LUMA of langflash_core/types.py (Rec. 601), in shaders.

float luma(vec3 rgb) {
    return dot(rgb, vec3(0.299, 0.587, 0.114));
}
