// Splatting, step 3: the records that serve each pixel, and their weights. [Yue §4, Tabellion] Deterministic: a tile's records
// are visited in ascending order. Run twice: first to count each pixel's records, then, behind a running sum over
// the counts, to write them. One workgroup = one tile of 16×16 pixels.
// In: pixels, sorted (tile, record) pairs. Out: counts, or lists of (record, weight) whose weights sum to 1.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/splat.glsl"
#include "include/records.glsl"

layout(local_size_x = 16, local_size_y = 16) in;
layout(constant_id = 0) const uint WRITES = 2;  // 0: count, 1: write

// What the splat could not do as it should; a tally, the same in any order.
struct SplatTally {
    uint relaxed;    // pixels that no record covers and that take the nearest one
    uint uncovered;  // pixels without even that
};
struct SplatTilesPush {
    uint width;
    uint height;
    uint tile_columns;
    uint record_count;
    uint pair_capacity;
    uint weight_capacity;
};

layout(scalar, binding = 0) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 1) readonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, binding = 2) readonly buffer CachePoints { CachePoint cache_points[]; };
layout(scalar, binding = 3) readonly buffer FirstPairs { uint first_pairs[]; };
layout(scalar, binding = 4) readonly buffer SortedPairs { TilePair sorted_pairs[]; };
layout(scalar, binding = 5) buffer PixelCounts { uint pixel_counts[]; };    // counts, then first weight of each pixel
layout(scalar, binding = 6) buffer Weights { SplatWeight weights[]; };
layout(scalar, binding = 7) buffer Tally { SplatTally tally; };
layout(scalar, push_constant) uniform Push { SplatTilesPush push; };

const uint BATCH = 256u;
shared CachePoint batch[BATCH];
shared uint batch_records[BATCH];
shared uint tile_range[2];

// First of the sorted pairs whose tile is not below `tile`.
uint lower_bound(uint tile, uint pair_count) {
    uint low = 0u;
    uint high = pair_count;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (sorted_pairs[middle].tile < tile) low = middle + 1u;
        else high = middle;
    }
    return low;
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint tile = gl_WorkGroupID.y * push.tile_columns + gl_WorkGroupID.x;
    if (thread < 2u) tile_range[thread] = lower_bound(tile + thread, min(first_pairs[push.record_count], push.pair_capacity));
    barrier();

    uvec2 xy = gl_GlobalInvocationID.xy;
    bool in_image = xy.x < push.width && xy.y < push.height;
    uint index = xy.y * push.width + xy.x;
    PixelSurface pixel = PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);
    if (in_image) pixel = pixels[index];
    // A side that sees no surface receives no indirect light, and has no records.
    bool wants_records = pixel.side != NO_SIDE
        && side_is_active(surfaces[pixel.side >> 1].sides, (pixel.side & 1u) != 0u);

    uint first = WRITES == 1u && in_image ? pixel_counts[index] : 0u;
    uint count = 0u;
    float sum = 0.0;
    uint nearest = NO_TARGET;
    float nearest_weight = -1e30;
    for (uint base = tile_range[0]; base < tile_range[1]; base += BATCH) {
        uint size = min(BATCH, tile_range[1] - base);
        barrier();
        if (thread < size) {
            batch_records[thread] = sorted_pairs[base + thread].record;
            batch[thread] = cache_points[batch_records[thread]];
        }
        barrier();
        if (!wants_records) continue;
        for (uint i = 0u; i < size; ++i) {
            float weight = record_weight(pixel.position, pixel.normal, batch[i]);
            if (weight > 0.0) {
                if (WRITES == 1u && first + count < push.weight_capacity) {
                    weights[first + count] = SplatWeight(batch_records[i], weight);
                }
                ++count;
                sum += weight;
            } else if (count == 0u && weight > nearest_weight && dot(pixel.normal, batch[i].normal) > 0.5) {
                nearest = batch_records[i];
                nearest_weight = weight;
            }
        }
    }
    if (!in_image) return;
    bool relaxed = wants_records && count == 0u && nearest != NO_TARGET;
    if (WRITES == 0u) {
        pixel_counts[index] = relaxed ? 1u : count;
        if (relaxed) atomicAdd(tally.relaxed, 1u);
        else if (wants_records && count == 0u) atomicAdd(tally.uncovered, 1u);
    } else if (relaxed) {
        if (first < push.weight_capacity) weights[first] = SplatWeight(nearest, 1.0);
    } else {
        for (uint i = first; i < min(first + count, push.weight_capacity); ++i) weights[i].weight /= sum;
    }
}
