// Structs of the splat kernels.

// Pixels that a record may touch.
struct PixelRectangle {
    uint low;   // first column | first row << 16
    uint high;  // one past the last column and row, packed alike
};

// Consecutive records that share a box; as in src/passes/frame/splat.rs.
const uint RECORD_BLOCK = 64u;

// The box around the surfaces of a tile of pixels, or around a block of records, metres.
struct TileBox {
    vec3 low;
    vec3 high;
};

// Tiles that a rectangle touches: the first, and one past the last.
uvec4 tiles_of(PixelRectangle rectangle) {
    uvec2 first = uvec2(rectangle.low & 0xffffu, rectangle.low >> 16);
    uvec2 end = uvec2(rectangle.high & 0xffffu, rectangle.high >> 16);
    return uvec4(first / 16u, (end + 15u) / 16u);
}

// Whether a sphere overlaps a box. Slightly enlarged: rounding must not lose a positive weight.
bool reaches(vec3 position, float radius, TileBox box) {
    vec3 apart = max(max(box.low - position, position - box.high), vec3(0.0));
    return dot(apart, apart) <= 1.002 * radius * radius;
}

// A record that may touch a tile.
struct TilePair {
    uint tile;
    uint record;
};

// A record and its weight at a pixel. The weights of a pixel sum to 1, or to -1 if no valid
// record covers it.
struct SplatWeight {
    uint record;
    float weight;
};

// The segment of weights that belongs to a pixel.
struct WeightRange {
    uint first;
    uint end;
};

// Counts of a view.
struct SplatTally {
    uint weights;    // of all pixels
    uint relaxed;  // pixels with relaxed records
    uint is_truncated;  // 1: some invocation had a truncated loop
};

// Push block of both sort kernels.
struct SortPush {
    uint shift;        // of the eight-bit digit
    uint block_count;
    uint record_count; // index of the pair count in `pair_offsets`
};
