// Structs of the splat kernels.

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
    uint relaxed;  // pixels with relaxed records and no valid one
    uint is_truncated;  // 1: some invocation had a truncated loop
    uint weighed;  // records that pixels weighed, with and without weight
};
