// Antialiasing: edge pixels are averaged over samples spread over their area; any other pixel shows
// its centre. Samples of a pixel that see one surface are a fragment. Light is found for fragments.

// Samples whose fragments share a texel: a mask of them for each fragment of the pixel.
const uint MASKED = 32u;

uint masks_of(uint samples) { return (samples + MASKED - 1u) / MASKED; }

// Fragment of sample `number` of a pixel, or MAX_FRAGMENTS. `first` is the pixel's first texel.
uint fragment_of(usamplerBuffer masks, uint first, uint number) {
    uvec4 members = texelFetch(masks, int(first + number / MASKED)) >> number % MASKED & 1u;
    return members.x != 0u ? 0u : members.y != 0u ? 1u : members.z != 0u ? 2u : members.w != 0u ? 3u : 4u;
}

// The samples of a fragment, in order.
struct Members {
    uint first;     // texel of the pixel
    uint fragment;  // number in its pixel
    uint word;      // of the next sample, or one before it
    uint mask;      // of those in that word that come next
};

Members members_of(usamplerBuffer masks, uint edge, uint count, uint fragment) {
    uint first = edge * masks_of(count);
    return Members(first, fragment, 0u, texelFetch(masks, int(first))[fragment]);
}

// The next sample; a fragment has as many as it says.
uint next_of(usamplerBuffer masks, inout Members members) {
    while (members.mask == 0u) {
        ++members.word;
        members.mask = texelFetch(masks, int(members.first + members.word))[members.fragment];
    }
    uint lowest = findLSB(members.mask);
    members.mask &= members.mask - 1u;
    return members.word * MASKED + lowest;
}

// What an edge pixel shows of one surface; its point has the same index in the list of surfaces.
struct Fragment {
    uint edge;        // index of its pixel in the list of edge pixels
    uint what;        // bits 0-3: place, of the nine row by row, of the pixel whose indirect light it takes; 4: it needs its own;
                      // 5-13: pixels of the nine that are alike; 14-31: number of its samples
    uint point;       // edge point whose indirect light it takes instead; NO_POINT: none
    uint neighbours;  // bit 4·n + k: fragment k of neighbour n is alike; neighbours are the nine without the fifth
};

const uint NO_POINT = 0xffffffffu;

Fragment fragment_at(usamplerBuffer list, uint index) {
    uvec4 words = texelFetch(list, int(index));
    return Fragment(words.x, words.y, words.z, words.w);
}

uint place_of(Fragment fragment) { return fragment.what & 15u; }
bool is_apart(Fragment fragment) { return (fragment.what >> 4 & 1u) != 0u; }
bool is_alike(Fragment fragment, uint place) { return (fragment.what >> (5u + place) & 1u) != 0u; }
uint samples_of(Fragment fragment) { return fragment.what >> 14; }

// Capacity of the lists of edge pixels.
struct EdgeCapacity {
    uint light_samples;  // of a fragment
    uint samples;        // of all edge pixels
    uint fragments;      // in all
    uint points;         // edge points in all
    uint tiles;          // of 8×8 pixels
};

const uint MAX_FRAGMENTS = 4u;  // of a pixel

// Samples of a pixel for each sample of a light in one of its fragments: more of them cost only at
// a move of the camera. As in src/passes/frame/edges.rs.
const uint COVERAGE = 4u;

// Fragments of each edge pixel within the capacity.
uint fragments_per_edge(uint edge_count, EdgeCapacity capacity) { return min(MAX_FRAGMENTS, capacity.fragments / max(edge_count, 1u)); }

// The number of samples of an edge pixel is a multiple of this.
const uint SAMPLE_STEP = 8u;

const uint MAX_SAMPLES = 256u;  // of a pixel; a multiple of SAMPLE_STEP

// Samples of an edge pixel if the capacity suffices: a multiple of SAMPLE_STEP.
uint max_samples(EdgeCapacity capacity) {
    return min(COVERAGE * capacity.light_samples + SAMPLE_STEP - 1u & ~(SAMPLE_STEP - 1u), MAX_SAMPLES);
}

// Samples of each edge pixel within the capacity, a multiple of SAMPLE_STEP; 0 if a pixel has one
// fragment, which would give all samples one surface.
uint samples_per_edge(uint edge_count, EdgeCapacity capacity) {
    uint count = min(max_samples(capacity), capacity.samples / max(edge_count, 1u) & ~(SAMPLE_STEP - 1u));
    return fragments_per_edge(edge_count, capacity) < 2u ? 0u : count;
}

// Words of the triangles that camera rays through a tile of 8×8 pixels may meet: their number, or
// TOO_MANY; triangles. The same for an edge pixel.
const uint TILE_WORDS = 512u;
const uint EDGE_WORDS = 64u;
const uint TOO_MANY = 0xffffffffu;

// Words of the list of edge pixels with too many triangles: sizes of dispatches over their samples;
// their number; over themselves; unused. Then the pixels, in any order.
const uint DENSE_HEADER = 8u;

// Number of edge pixels with memory for triangles: as many as can have all samples.
uint edges_in(EdgeCapacity capacity) { return capacity.samples / max(max_samples(capacity), 1u); }

// Marks a pixel that is no edge pixel in the list that maps pixels to edge pixels.
const uint NO_EDGE = 0xffffffffu;

// The pixel at one of the nine positions around another, clamped to the image.
uint pixel_at(uvec2 size, uint pixel, uint place) {
    ivec2 xy = ivec2(in_rows(pixel, size.x)) + ivec2(place % 3u, place / 3u) - 1;
    uvec2 inside = uvec2(clamp(xy, ivec2(0), ivec2(size) - 1));
    return inside.y * size.x + inside.x;
}
