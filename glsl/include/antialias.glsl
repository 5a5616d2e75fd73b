// Pixels that show an edge are averaged over samples spread over their area; the others are what
// their centres see. Samples of a pixel that take indirect light from the same pixel and show the
// same material share a slot: direct light is summed up in it.

// What a sample of an edge pixel sees. Where, follows from its number and the side.
struct EdgeSample {
    uint side;  // NO_SIDE where none of its points met a surface
    uint what;  // bits 0-2: which of its points it shows; 3-6: eighths of them that met a surface; 7-10: place of the pixel whose
                // indirect light it takes among the nine around, row by row; 11-12: its slot
};

EdgeSample edge_sample_of(uvec2 words) { return EdgeSample(words.x, words.y); }

// What some samples of an edge pixel have in common.
struct EdgeSlot {
    uint side;  // of the first of them; NO_SIDE: nobody's, as all slots behind it
    uint what;  // bits 0-3: place of the pixel whose indirect light they take; from bit 4: their eighths, summed
};

// Capacity of the lists of edge pixels.
struct EdgeCapacity {
    uint max_samples;  // of a pixel
    uint samples;       // in all
    uint slots;         // in all
};

const uint MAX_SLOTS = 4u;  // of a pixel

// Pixels whose frusta have space where the shafts of 64 samples each had theirs.
uint frusta_in(EdgeCapacity capacity) { return (capacity.samples + 63u) / 64u; }

// Slots of each edge pixel.
uint slots_per_edge(uint edge_count, EdgeCapacity capacity) { return min(MAX_SLOTS, capacity.slots / max(edge_count, 1u)); }

// Samples of each edge pixel: as many as there is room for, if that is enough to be better than the
// centre alone: MIN_SAMPLES in src/passes/frame/antialias.rs. One slot would take all for one
// surface.
uint samples_per_edge(uint edge_count, EdgeCapacity capacity) {
    uint count = min(capacity.max_samples, capacity.samples / max(edge_count, 1u));
    return count < 4u || slots_per_edge(edge_count, capacity) < 2u ? 0u : count;
}

// In a list of a number for each pixel, that of edge pixels in the order of their list, and behind
// the last how many there are: no edge pixel.
const uint NO_EDGE = 0xffffffffu;

uint point_of(EdgeSample found) { return found.what & 7u; }
uint eighths_of(EdgeSample found) { return found.what >> 3 & 15u; }
uint place_of(EdgeSample found) { return found.what >> 7 & 15u; }
uint slot_of(EdgeSample found) { return found.what >> 11 & 3u; }

uint place_of(EdgeSlot slot) { return slot.what & 15u; }
// Share of a pixel's `count` samples that a slot stands for.
float weight_of(EdgeSlot slot, uint count) { return float(slot.what >> 4) / float(8u * count); }

// The pixel at one of the nine places around another; beyond its edges the image repeats itself.
uint pixel_at(uvec2 size, uint pixel, uint place) {
    ivec2 xy = ivec2(in_rows(pixel, size.x)) + ivec2(place % 3u, place / 3u) - 1;
    uvec2 inside = uvec2(clamp(xy, ivec2(0), ivec2(size) - 1));
    return inside.y * size.x + inside.x;
}
