// Antialiasing: edge pixels are averaged over samples spread over their area; any other pixel shows
// its centre. Samples of a pixel share a slot if they take indirect light from the same pixel and
// show the same material; the slot sums their direct light.

// The surface at a sample of an edge pixel. Its position follows from its index and the side.
struct EdgeSample {
    uint side;  // NO_SIDE if none of its image points met a surface
    uint what;  // bits 0-2: image point that it shows; 3-6: eighths of its image points that met one; 7-10: position of the pixel whose
                // indirect light it takes among the nine around, row by row; 11-12: slot; 13: apart
};

// No pixel around a sample serves it: its indirect light needs a point of its own.
const uint IS_APART = 1u << 13;

EdgeSample edge_sample_of(uvec2 words) { return EdgeSample(words.x, words.y); }

// The data that samples of one slot share.
struct EdgeSlot {
    uint side;  // of its first sample; NO_SIDE: this slot and all later ones are empty
    uint what;  // bits 0-3: place of the pixel whose indirect light they take; 4-30: their eighths, summed; 31: they need an edge point
    uint point;  // edge point whose indirect light they take instead; NO_POINT: none
};

const uint NO_POINT = 0xffffffffu;

// Capacity of the lists of edge pixels.
struct EdgeCapacity {
    uint max_samples;  // of a pixel
    uint samples;       // in all
    uint slots;         // in all
    uint points;        // edge points in all
};

const uint MAX_SLOTS = 4u;  // of a pixel

// Number of pixels with memory for a frustum: frusta reuse the shafts of batches of 64 samples.
uint frusta_in(EdgeCapacity capacity) { return (capacity.samples + 63u) / 64u; }

uint slots_per_edge(uint edge_count, EdgeCapacity capacity) { return min(MAX_SLOTS, capacity.slots / max(edge_count, 1u)); }

// Samples of each edge pixel within the capacity; 0 if fewer than MIN_SAMPLES
// (src/passes/frame/antialias.rs), which would be no better than the centre alone, or if a pixel
// has one slot, which would give all samples one surface.
uint samples_per_edge(uint edge_count, EdgeCapacity capacity) {
    uint count = min(capacity.max_samples, capacity.samples / max(edge_count, 1u));
    return count < 4u || slots_per_edge(edge_count, capacity) < 2u ? 0u : count;
}

// Marks a pixel that is no edge pixel in the list that maps pixels to edge pixels.
const uint NO_EDGE = 0xffffffffu;

uint point_of(EdgeSample found) { return found.what & 7u; }
uint eighths_of(EdgeSample found) { return found.what >> 3 & 15u; }
uint place_of(EdgeSample found) { return found.what >> 7 & 15u; }
uint slot_of(EdgeSample found) { return found.what >> 11 & 3u; }

bool is_apart(EdgeSample found) { return (found.what & IS_APART) != 0u; }

uint place_of(EdgeSlot slot) { return slot.what & 15u; }
bool is_apart(EdgeSlot slot) { return slot.what >> 31 != 0u; }
// Fraction of a pixel's `count` samples in a slot.
float weight_of(EdgeSlot slot, uint count) { return float((slot.what & 0x7fffffffu) >> 4) / float(8u * count); }

// The pixel at one of the nine positions around another, clamped to the image.
uint pixel_at(uvec2 size, uint pixel, uint place) {
    ivec2 xy = ivec2(in_rows(pixel, size.x)) + ivec2(place % 3u, place / 3u) - 1;
    uvec2 inside = uvec2(clamp(xy, ivec2(0), ivec2(size) - 1));
    return inside.y * size.x + inside.x;
}
