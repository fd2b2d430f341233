// Purpose: what shows through the gaps of a picture, where GAPS is set. Source: langflash_core/scene/gaps.py, `pushed`.

#ifdef GAPS
uniform sampler2D gaps;  // premultiplied, half the size, linear
#endif

vec4 over_gaps(vec4 own) {
#ifdef GAPS
    own += (1.0 - own.a) * texture(gaps, 0.5 * gl_FragCoord.xy / vec2(textureSize(gaps, 0)));
#endif
    return own;
}
