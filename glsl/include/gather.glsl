// The gather hemisphere of a cache point: RINGS rings of equal cosine-weighted solid angle
// with SECTORS sectors each, one jittered ray a stratum. The including shader declares
// RINGS and SECTORS.

struct Stratum { uint ring; uint sector; };

Stratum stratum_of(uint ray) { return Stratum(ray / SECTORS, ray % SECTORS); }

// Local direction (z = normal) of a ray; `stream` selects the hemisphere. Each stratum has
// a scrambled sequence over the streams, so that points with consecutive ones divide the stratum
// among their rays.
vec3 stratum_direction(Stratum s, uint stream, uint seed) {
    vec2 jitter = sample_3d(stream, hash(s.ring * SECTORS + s.sector, seed)).xy;
    return sample_cosine((vec2(s.ring, s.sector) + jitter) / vec2(RINGS, SECTORS));
}
