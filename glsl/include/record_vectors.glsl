// Records that are read one by one from all over a buffer, where reading is what takes the time: 24 floats as six aligned vectors,
// which are six loads. Include after types.glsl, where the shader binds `vec4 record_vectors[]`.

Record record_at(uint index) {
    vec4 a = record_vectors[6u * index];
    vec4 b = record_vectors[6u * index + 1u];
    vec4 c = record_vectors[6u * index + 2u];
    vec4 d = record_vectors[6u * index + 3u];
    vec4 e = record_vectors[6u * index + 4u];
    vec4 f = record_vectors[6u * index + 5u];
    return Record(a.xyz, vec3(a.w, b.xy), mat3(b.zw, c, d.xyz), mat3(d.w, e, f));
}
