// Marks of penumbrae: the light at a point is negative if it sees only a part of an area light.
// Include after direct.glsl.

bool is_marked(float light) { return floatBitsToUint(light) >> 31 != 0u; }

float with_mark(float light, bool has_mark) { return uintBitsToFloat(floatBitsToUint(light) | (has_mark ? 0x80000000u : 0u)); }

// What earlier dispatches for one part of a light have seen, by the light that they stored:
// between these, the mark says that samples are hidden.
uint seen_before(float before, uint flags) {
    if ((flags & ADDS) != 0u) return 0u;
    return (is_marked(before) ? SEES_HIDDEN : 0u) | (abs(before) > 0.0 ? SEES_LIT : 0u);
}

// Whether the light at a point has the mark after a dispatch, the last for its part if `is_last`.
// Earlier parts of the light may have set it.
bool has_mark(float before, uint seen, uint flags, bool is_last) {
    bool is_part = (flags & ADDS) != 0u;
    return is_last ? seen == (SEES_LIT | SEES_HIDDEN) || (is_part && is_marked(before)) : (seen & SEES_HIDDEN) != 0u;
}
