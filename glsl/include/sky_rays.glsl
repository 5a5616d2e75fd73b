// Rays of an entry point that sample the sky. Include after math.glsl and gather.glsl.

const uint SKY_RAYS = RINGS * SECTORS;  // a multiple of 32
const uint SKY_WORDS = SKY_RAYS / 32u;  // of an entry point, a bit a ray

// Unit direction of a ray of the entry point with that random stream index; cosine-distributed.
vec3 sky_ray(vec3 normal, uint ray, uint stream, uint seed) {
    return frame_around(normal) * stratum_direction(stratum_of(ray), stream, seed);
}
