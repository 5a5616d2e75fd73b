// Corners of a triangle. The including shader binds the texels `Triangles`.

struct Corners {
    vec3 p0;
    vec3 p1;
    vec3 p2;
};

Corners corners_of(uint index) {
    if (USE_BUFFER_DEVICE_ADDRESS != 0u) {
        Triangle t = TriangleList(texelFetch(Triangles, 0).xy).items[index];
        return Corners(t.p0.xyz, t.p1.xyz, t.p2.xyz);
    }
    int first = int(TRIANGLE_TEXELS * index);
    return Corners(uintBitsToFloat(texelFetch(Triangles, first).xyz), uintBitsToFloat(texelFetch(Triangles, first + 1).xyz),
                   uintBitsToFloat(texelFetch(Triangles, first + 2).xyz));
}
