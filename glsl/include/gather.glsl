// The gather hemisphere of a cache point: RINGS rings of equal cosine-weighted solid angle, SECTORS sectors each, one
// jittered ray a stratum. The including shader declares RINGS and SECTORS.

struct Stratum { uint ring; uint sector; };

Stratum stratum_of(uint ray) { return Stratum(ray / SECTORS, ray % SECTORS); }

// Local direction (z = normal) of a ray of the hemisphere that `point` names.
vec3 stratum_direction(Stratum s, uint point, uint seed) {
    uint bits = hash(point * (RINGS * SECTORS) + s.ring * SECTORS + s.sector, seed);
    vec2 jitter = vec2(bits & 0xffffu, bits >> 16) * (1.0 / 65536.0) + 0.5 / 65536.0;
    return sample_cosine((vec2(s.ring, s.sector) + jitter) / vec2(RINGS, SECTORS));
}
