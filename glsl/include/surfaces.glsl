// Attributes of a triangle besides its corners. The including shader binds the texels `Surfaces`.
Surface surface_at(uint index) {
    if (USE_BUFFER_DEVICE_ADDRESS != 0u) return SurfaceList(texelFetch(Surfaces, 0).xy).items[index];
    int first = int(SURFACE_TEXELS * index);
    uvec4 a = texelFetch(Surfaces, first);
    uvec4 b = texelFetch(Surfaces, first + 1);
    vec4 c = uintBitsToFloat(texelFetch(Surfaces, first + 2));
    vec4 d = uintBitsToFloat(texelFetch(Surfaces, first + 3));
    return Surface(uintBitsToFloat(a.xyz), a.w, b.x, uintBitsToFloat(b.yzw), c.xyz, vec3(c.w, d.xy), uvec2(0u));
}

// Unit geometric normal of a side.
vec3 facet_of(Surface surface, uint side) { return (side & 1u) != 0u ? -surface.normal : surface.normal; }
vec3 facing_normal(uint side) { return facet_of(surface_at(side >> 1), side); }
