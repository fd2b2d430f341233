// Purpose: a picture in half the sides, which lies in the corner of its texture, at a pixel of the whole one: which four
//          texels show it, and their shares. Source: bilinear interpolation; pixel centres p + .5 are at half of that.
// Frames: texel = pixel of half the size.

// low.xy, high.zw
ivec4 halved_texels(ivec2 pixel, ivec2 size) {
    ivec2 low = (pixel + 1) / 2 - 1;
    return ivec4(max(low, 0), min(low + 1, (size + 1) / 2 - 1));
}

// of the high ones
vec2 halved_shares(ivec2 pixel) {
    return mix(vec2(0.75), vec2(0.25), vec2(pixel & 1));
}
