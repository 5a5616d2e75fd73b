// Corners of a triangle. The including shader binds `Triangle triangles[]`.
Triangle triangle_at(uint index) {
    if (FOLLOWS_ADDRESSES == 0u) return triangles[index];
    return TriangleList(floatBitsToUint(triangles[0].p0.xy)).items[index];
}
