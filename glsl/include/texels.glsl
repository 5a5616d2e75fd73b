// Structs of whole texels, four words each, in lists that a kernel only reads: one load a
// texel. A struct member in storage is one load a word, which a CPU does lane by lane.
// Include after types.glsl.

vec4 numbers(uvec4 words) { return uintBitsToFloat(words); }

// Words and pairs load the texel that holds them; triples load both texels that they may touch.
uint word_at(usamplerBuffer list, uint index) { return texelFetch(list, int(index >> 2))[index & 3u]; }
float number_at(usamplerBuffer list, uint index) { return uintBitsToFloat(word_at(list, index)); }
uvec2 pair_at(usamplerBuffer list, uint index) {
    uvec4 both = texelFetch(list, int(index >> 1));
    return (index & 1u) != 0u ? both.zw : both.xy;
}

uvec3 triple_at(usamplerBuffer list, uint index) {
    uint word = 3u * index;
    uvec4 first = texelFetch(list, int(word >> 2)), second = texelFetch(list, int((word + 2u) >> 2));
    switch (word & 3u) {
        case 0u: return first.xyz;
        case 1u: return first.yzw;
        case 2u: return uvec3(first.zw, second.x);
        default: return uvec3(first.w, second.xy);
    }
}

PixelSurface pixel_surface_at(usamplerBuffer list, uint index) {
    uvec4 first = texelFetch(list, int(2u * index));
    vec4 second = numbers(texelFetch(list, int(2u * index + 1u)));
    return PixelSurface(uintBitsToFloat(first.xyz), first.w, second.xyz, second.w);
}

CachePoint cache_point_at(usamplerBuffer list, uint index) {
    int first = int(4u * index);
    vec4 a = numbers(texelFetch(list, first));
    uvec4 b = texelFetch(list, first + 1);
    vec4 c = numbers(texelFetch(list, first + 2));
    uvec4 d = texelFetch(list, first + 3);
    vec3 last = uintBitsToFloat(d.xyz);
    return CachePoint(a.xyz, a.w, uintBitsToFloat(b.xyz), b.w, c.xyz, vec3(c.w, last.xy), last.z, d.w);
}

Reflectance reflectance_at(usamplerBuffer list, uint index) {
    vec4 first = numbers(texelFetch(list, int(2u * index)));
    uvec4 second = texelFetch(list, int(2u * index + 1u));
    return Reflectance(first.xyz, first.w, uintBitsToFloat(second.xyz), second.w);
}

LightSource light_at(usamplerBuffer list, uint index) {
    int first = int(6u * index);
    uvec4 a = texelFetch(list, first);
    vec4 b = numbers(texelFetch(list, first + 1));
    vec4 c = numbers(texelFetch(list, first + 2));
    vec4 d = numbers(texelFetch(list, first + 3));
    uvec4 e = texelFetch(list, first + 4);
    uvec4 f = texelFetch(list, first + 5);
    return LightSource(uintBitsToFloat(a.xyz), a.w, b.xyz, b.w, c.xyz, c.w, d.xyz, d.w, uintBitsToFloat(e.xyz), e.w, f.x, f.y, uintBitsToFloat(f.z), f.w);
}

Contribution contribution_at(usamplerBuffer list, uint index) {
    uvec4 words = texelFetch(list, int(index));
    return Contribution(uintBitsToFloat(words.xyz), words.w);
}

ContributionRange contribution_range_at(usamplerBuffer list, uint index) {
    uvec4 words = texelFetch(list, int(index));
    return ContributionRange(words.x, words.y, words.z, words.w);
}

Record record_at(usamplerBuffer list, uint index) {
    int first = int(6u * index);
    vec4 a = numbers(texelFetch(list, first));
    vec4 b = numbers(texelFetch(list, first + 1));
    vec4 c = numbers(texelFetch(list, first + 2));
    vec4 d = numbers(texelFetch(list, first + 3));
    vec4 e = numbers(texelFetch(list, first + 4));
    vec4 f = numbers(texelFetch(list, first + 5));
    return Record(a.xyz, vec3(a.w, b.xy), mat3(b.zw, c, d.xyz), mat3(d.w, e, f));
}
