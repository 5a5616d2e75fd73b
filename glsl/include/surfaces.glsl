// What a triangle has besides its corners. The including shader binds `Surface surfaces[]`.
Surface surface_at(uint index) {
    if (FOLLOWS_ADDRESSES == 0u) return surfaces[index];
    return SurfaceList(floatBitsToUint(surfaces[0].normal.xy)).items[index];
}
