// Structs of the kernels that sort pairs.

// A record that may touch a tile.
struct TilePair {
    uint tile;
    uint record;
};

// Push block of both sort kernels.
struct SortPush {
    uint shift;        // of the eight-bit digit
    uint block_count;
    uint record_count; // index of the pair count in `pair_offsets`
};
