// Purpose: nothing where alpha falls below 1/255; needs footprint.glsl.
// Source: own. What adds zeros leaves a pixel as it is, to the bit, like what is discarded. On a processor (SOFTWARE)
//         it costs less: there every discarding fragment carries a mask along.

float shown_alpha(vec2 offset_px, vec4 whitening) {
    float alpha = splat_alpha(offset_px, whitening);
#ifdef SOFTWARE
    return alpha < ALPHA_MIN ? 0.0 : alpha;
#else
    if (alpha < ALPHA_MIN) discard;
    return alpha;
#endif
}
