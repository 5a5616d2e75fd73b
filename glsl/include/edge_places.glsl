// Places of the samples of edge pixels. Include after sampling.glsl.

// The bits of a byte, reversed.
uint reversed(uint byte) { return ((byte * 0x0802u & 0x22110u) | (byte * 0x8020u & 0x88440u)) * 0x10101u >> 16 & 0xffu; }

// Place of sample `index` < 256 in its pixel: the first two Sobol dimensions, the bits flipped by
// the pixel. Cheaper than `sample_3d`, whose scrambling is not needed: no sum has many pixels.
vec2 place_in_pixel(uint index, uint pixel) {
    uint pascal = index ^ (index >> 1 & 0x55u);
    pascal ^= pascal >> 2 & 0x33u;
    pascal ^= pascal >> 4 & 0x0fu;
    uvec2 fractions = uvec2(reversed(index), reversed(pascal)) << 24 ^ uvec2(hash(pixel), hash(pixel, 1u));
    return vec2(unit_float(fractions.x), unit_float(fractions.y));
}
