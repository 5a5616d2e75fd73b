// Deterministic low-discrepancy sampling: Owen-scrambled Sobol points by hashing. [Burley]

// Integer hash with low bias (two rounds of xor-shift and multiply).
uint hash(uint x) {
    x ^= x >> 16;
    x *= 0x21f0aaadu;
    x ^= x >> 15;
    x *= 0xd35a2d97u;
    return x ^ (x >> 15);
}

uint hash(uint a, uint b) { return hash(a ^ hash(b + 0x9e3779b9u)); }

// Nested uniform scramble of a bit-reversed value: the bits below a bit decide whether
// it is flipped.
uint laine_karras(uint x, uint seed) {
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

uint owen_scramble(uint x, uint seed) { return bitfieldReverse(laine_karras(bitfieldReverse(x), seed)); }

// Direction numbers of the third Sobol dimension (primitive polynomial x²+x+1).
const uint SOBOL_2[32] = uint[](
    0x80000000u, 0xc0000000u, 0x60000000u, 0x90000000u, 0xe8000000u, 0x5c000000u, 0x8e000000u, 0xc5000000u,
    0x68800000u, 0x9cc00000u, 0xee600000u, 0x55900000u, 0x80680000u, 0xc09c0000u, 0x60ee0000u, 0x90550000u,
    0xe8808000u, 0x5cc0c000u, 0x8e606000u, 0xc5909000u, 0x6868e800u, 0x9c9c5c00u, 0xeeee8e00u, 0x5555c500u,
    0x8000e880u, 0xc0005cc0u, 0x60008e60u, 0x9000c590u, 0xe8006868u, 0x5c009c9cu, 0x8e00eeeeu, 0xc5005555u);

// Point `index` of the first three Sobol dimensions, unscrambled, as 32-bit fractions.
uvec3 sobol(uint index) {
    // Bit p of the second dimension, from the top, sums the bits k of the index for which C(k, p)
    // is odd: those k that have all of p's bits. Five steps sum over supersets.
    uint pascal = index ^ ((index >> 1) & 0x55555555u);
    pascal ^= (pascal >> 2) & 0x33333333u;
    pascal ^= (pascal >> 4) & 0x0f0f0f0fu;
    pascal ^= (pascal >> 8) & 0x00ff00ffu;
    pascal ^= pascal >> 16;
    // A fixed length, so that compilers unroll it and the table turns into constants.
    uint third = 0u;
    for (uint bit = 0u; bit < 32u; ++bit) third ^= SOBOL_2[bit] & (0u - ((index >> bit) & 1u));
    return uvec3(bitfieldReverse(index), bitfieldReverse(pascal), third);
}

float unit_float(uint fraction) { return float(fraction >> 8) * (1.0 / 16777216.0); }

// Point `index` of the sequence scrambled by `seed`, in [0,1)³.
vec3 sample_3d(uint index, uint seed) {
    uvec3 point = sobol(owen_scramble(index, hash(seed)));
    return vec3(unit_float(owen_scramble(point.x, hash(seed, 1u))), unit_float(owen_scramble(point.y, hash(seed, 2u))),
                unit_float(owen_scramble(point.z, hash(seed, 3u))));
}

// Cosine-distributed direction around +z; pdf cosθ/π.
vec3 sample_cosine(vec2 u) {
    float radius = sqrt(u.x);
    float angle = 6.28318530717959 * u.y;
    return vec3(radius * cos(angle), radius * sin(angle), sqrt(max(0.0, 1.0 - u.x)));
}
