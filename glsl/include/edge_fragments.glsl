// Groups the samples of an edge pixel into fragments. A sample joins the fragment whose first
// sample it resembles most, if the material is the same and no edge is between both; else it begins
// a fragment. Samples on one side of a triangle stay together. If the fragments run out, a sample
// joins the most similar one. Include after alike.glsl and primary.glsl.

const uint KNOWN = 8u;  // sides whose fragment is kept in mind
const uint NO_FRAGMENT = MAX_FRAGMENTS;

// The fragments of this invocation's pixel so far.
struct EdgeFragments {
    uint used;
    PixelSurface shown[MAX_FRAGMENTS];  // by the first sample
    vec3 facets[MAX_FRAGMENTS];
    uint materials[MAX_FRAGMENTS];
    uint known_sides[KNOWN];
    uint known_fragments;  // half a byte each
    uint compared;         // sides so far
};

// Sides that MASKED samples see.
uint seen[MASKED];

EdgeFragments no_fragments() {
    EdgeFragments none;
    none.used = none.known_fragments = none.compared = 0u;
    for (uint k = 0u; k < KNOWN; ++k) none.known_sides[k] = NO_SIDE;
    return none;
}

// Samples of `seen` on a side.
uint on_side(uint side) {
    uint mask = 0u;
    for (uint k = 0u; k < MASKED; ++k) mask |= uint(seen[k] == side) << k;
    return mask;
}

// Finds the fragment of a side that is not known yet, by the sample through an image point.
uint add_side(inout EdgeFragments fragments, View view, vec2 point, uint side, uint most) {
    PixelSurface found = seen_on(view, point, side);
    Surface surface = surface_at(side >> 1);
    vec3 facet = facet_of(surface, side);
    uint own = 0u;
    float least = 1e30;
    for (uint k = 0u; k < MAX_FRAGMENTS; ++k) {
        float cost = dissimilarity(found, facet, fragments.shown[k], fragments.facets[k]) + (fragments.materials[k] == surface.material ? 0.0 : 1e3);
        if (k >= fragments.used) cost = 1e30;
        own = cost < least ? k : own;
        least = min(cost, least);
    }
    bool is_new = least > uintBitsToFloat(ALIKE) && fragments.used < most;
    own = is_new ? fragments.used++ : own;
    for (uint k = 0u; k < MAX_FRAGMENTS; ++k) {
        if (!is_new || own != k) continue;
        fragments.shown[k] = found;
        fragments.facets[k] = facet;
        fragments.materials[k] = surface.material;
    }
    uint place = fragments.compared++ % KNOWN;
    for (uint k = 0u; k < KNOWN; ++k) fragments.known_sides[k] = k == place ? side : fragments.known_sides[k];
    fragments.known_fragments = fragments.known_fragments & ~(15u << 4u * place) | own << 4u * place;
    return own;
}

// Masks of the samples of `seen`, the first of which has number `first`, for each fragment.
uvec4 group_samples(inout EdgeFragments fragments, View view, uint pixel, uint first, uint most) {
    vec2 corner = vec2(in_rows(pixel, view.width));
    uvec4 masks = uvec4(0u);
    for (uint open = ~on_side(NO_SIDE); open != 0u;) {
        uint lowest = findLSB(open);
        uint side = NO_SIDE;
        for (uint k = 0u; k < MASKED; ++k) side = k == lowest ? seen[k] : side;
        uint own = NO_FRAGMENT;
        for (uint k = 0u; k < KNOWN; ++k) own = fragments.known_sides[k] == side ? fragments.known_fragments >> 4u * k & 15u : own;
        if_any (own == NO_FRAGMENT) own = add_side(fragments, view, corner + place_in_pixel(first + lowest, pixel), side, most);
        uint mask = on_side(side);
        for (uint k = 0u; k < MAX_FRAGMENTS; ++k) masks[k] |= own == k ? mask : 0u;
        open &= ~mask;
    }
    return masks;
}
