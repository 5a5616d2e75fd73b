// What a triangle has besides its corners. The including shader binds `Surface surfaces[]`.
Surface surface_at(uint index) {
    if (FOLLOWS_ADDRESSES == 0u) return surfaces[index];
    return SurfaceList(floatBitsToUint(surfaces[0].normal.xy)).items[index];
}

// Unit geometric normal of a side.
vec3 facet_of(Surface surface, uint side) { return (side & 1u) != 0u ? -surface.normal : surface.normal; }
vec3 facing_normal(uint side) { return facet_of(surface_at(side >> 1), side); }
