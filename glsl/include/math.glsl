// Small geometry: frames, ray origins.

const float PI = 3.14159265358979;

// Orthonormal frame around a unit vector; columns tangent, bitangent, n. [Duff 2017]
mat3 frame_around(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// Moves a ray origin off its surface by a few units in the last place of the coordinate, towards `normal`,
// which keeps the distance right at every scale. [WaechterBinder]
vec3 offset_origin(vec3 p, vec3 normal) {
    const float origin = 1.0 / 32.0;
    const float float_scale = 1.0 / 65536.0;
    const float int_scale = 256.0;
    ivec3 steps = ivec3(int_scale * normal);
    vec3 moved = intBitsToFloat(floatBitsToInt(p) + mix(steps, -steps, lessThan(p, vec3(0.0))));
    return mix(moved, p + float_scale * normal, lessThan(abs(p), vec3(origin)));
}
