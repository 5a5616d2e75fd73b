// Structs that the steps of the splat hand to each other.

// Pixels that a record may touch.
struct PixelRectangle {
    uint low;   // first column | first row << 16
    uint high;  // one past the last column and row, packed alike
};

// A record that may touch a tile.
struct TilePair {
    uint tile;
    uint record;
};

// A record that serves a pixel; a pixel's weights sum to 1.
struct SplatWeight {
    uint record;
    float weight;
};

// Pixels that no record covers.
struct SplatTally { uint bare; };

// Push block of both sort kernels.
struct SortPush {
    uint shift;        // of the eight-bit digit
    uint block_count;
    uint record_count; // where the pair count stands in the running counts
};
