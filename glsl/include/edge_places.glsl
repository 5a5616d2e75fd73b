// Places of the samples of edge pixels. Include after sampling.glsl.

// The bits of a byte, reversed.
uint reversed(uint byte) { return ((byte * 0x0802u & 0x22110u) | (byte * 0x8020u & 0x88440u)) * 0x10101u >> 16 & 0xffu; }

// Sample `index` < 256 of every pixel, as fractions: the first two Sobol dimensions. The sample of
// an exclusive or is the exclusive or of the samples.
uvec2 sobol_2d(uint index) {
    uint pascal = index ^ (index >> 1 & 0x55u);
    pascal ^= pascal >> 2 & 0x33u;
    pascal ^= pascal >> 4 & 0x0fu;
    return uvec2(reversed(index), reversed(pascal)) << 24;
}

// What flips the bits of the samples in a pixel. Cheaper than `sample_3d`, whose scrambling is not
// needed: no sum has many pixels.
uvec2 flips_of(uint pixel) { return uvec2(hash(pixel), hash(pixel, 1u)); }

vec2 unit_floats(uvec2 fractions) { return vec2(unit_float(fractions.x), unit_float(fractions.y)); }

// Place of sample `index` in its pixel.
vec2 place_in_pixel(uint index, uint pixel) { return unit_floats(sobol_2d(index) ^ flips_of(pixel)); }
