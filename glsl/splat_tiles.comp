// Splatting, step 3: the records that serve each pixel, and their weights. [Yue §4, Tabellion] A
// pixel's weights are deterministic, because the records of a tile are visited in ascending order;
// the position of its segment is not, because tiles allocate in any order. A pixel keeps up to KEPT
// weights in registers until their number is known. Tiles with more are listed and visited again.
// One workgroup = one tile of 16×16 pixels. In: pixels, sorted (tile, record) pairs. Out: segments
// of (record, weight) whose weights sum to 1; uncovered pixels, each with space for one weight.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/splat.glsl"
#include "include/records.glsl"

layout(local_size_x = 256) in;
layout(constant_id = 0) const uint CROWDED = 2;  // 0: all tiles; 1: the pixels of listed tiles with more than KEPT weights

struct SplatTilesPush {
    uint width;
    uint height;
    uint record_count;
    uint pair_capacity;
    uint weight_capacity;
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(binding = 1) uniform usamplerBuffer Pixels;
layout(binding = 2) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 3) readonly buffer Rectangles { PixelRectangle rectangles[]; };
layout(scalar, binding = 4) readonly buffer PairOffsets { uint pair_offsets[]; };
layout(scalar, binding = 5) readonly buffer SortedPairs { TilePair sorted_pairs[]; };
layout(scalar, binding = 6) buffer WeightRanges { WeightRange weight_ranges[]; };  // of each pixel
layout(scalar, binding = 7) buffer Weights { SplatWeight weights[]; };
layout(scalar, binding = 8) buffer Tally { SplatTally tally; };
// Both lists: workgroups along each axis, one an item; the number of items; the items, in any
// order, because each is handled by itself.
layout(scalar, binding = 9) buffer UncoveredPixels { uint uncovered_pixels[]; };
layout(scalar, binding = 10) buffer CrowdedTiles { uint crowded_tiles[]; };
layout(scalar, push_constant) uniform Push { SplatTilesPush push; };

#include "include/surfaces.glsl"
#include "include/quirks.glsl"

const uint KEPT = 8u;  // weights of a pixel in registers
const uint BATCH = 256u;
shared uint batch_records[BATCH];
shared uint batch_bounds[BATCH];  // columns of the tile that the record may touch, a bit each; rows in the upper half
shared uint touching[BATCH];      // the same transposed, for groups of 32 records: 16 columns and 16 rows, a bit a record
shared uint tile_range[2];
shared uint wanting;
shared uint tile_weights;  // their number
shared uint tile_first;    // index of the first one
shared uint crowding;      // 1: some pixel has more than KEPT

void list_uncovered(uint pixel) {
    uint place = atomicAdd(uncovered_pixels[3], 1u);
    uncovered_pixels[4u + place] = pixel;
    for (uint axis = 0u; axis < 3u; ++axis) atomicMax(uncovered_pixels[axis], swizzled(place + 1u)[axis]);
}

void list_crowded(uint tile) {
    uint place = atomicAdd(crowded_tiles[3], 1u);
    crowded_tiles[4u + place] = tile;
    for (uint axis = 0u; axis < 3u; ++axis) atomicMax(crowded_tiles[axis], swizzled(place + 1u)[axis]);
}

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

// A record's pixel rectangle clipped to the tile at `corner`, as a mask of columns and a
// mask of rows.
uint bounds_in_tile(PixelRectangle rectangle, uvec2 corner) {
    uvec2 low = uvec2(rectangle.low & 0xffffu, rectangle.low >> 16);
    uvec2 high = uvec2(rectangle.high & 0xffffu, rectangle.high >> 16);
    low = max(low, corner) - corner;
    high = clamp(high, corner, corner + 16u) - corner;
    uvec2 bits = (uvec2(1u) << high) - (uvec2(1u) << min(low, high));
    return bits.x | (bits.y << 16);
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint tile = flat_workgroup();
    if (CROWDED == 1u) {
        if (tile >= crowded_tiles[3]) return;
        tile = crowded_tiles[4u + tile];
    }
    uvec2 place = place_in_tile(16u);
    uvec2 corner = corner_of_tile(tile, 16u, push.width);
    if (thread == 0u) tile_weights = crowding = 0u;
    if (thread < 2u) tile_range[thread] = lower_bound(tile + thread, min(pair_offsets[push.record_count], push.pair_capacity));
    barrier();

    uvec2 xy = corner + place;
    bool in_image = xy.x < push.width && xy.y < push.height;
    uint index = xy.y * push.width + xy.x;
    PixelSurface pixel = PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);
    if (in_image) pixel = pixel_surface_at(Pixels, index);
    // An inactive side receives no indirect light and has no records.
    bool wants_records = false;
    vec3 facet = vec3(0.0);
    if (pixel.side != NO_SIDE) {
        Surface surface = surface_at(pixel.side >> 1);
        wants_records = side_is_active(surface.sides, (pixel.side & 1u) != 0u);
        facet = facet_of(surface, pixel.side);
    }

    uint first = 0u;
    if (CROWDED == 1u && in_image) {
        WeightRange range = weight_ranges[index];
        wants_records = range.end - range.first > KEPT;
        first = range.first;
    }
    SplatWeight kept[KEPT];
    uint count = 0u;
    float sum = 0.0;
    // The second iteration runs only if some pixel of the tile found no record in the first.
    Tolerance tolerance = VALID;
    bool is_relaxed = false;
    for (uint pass = 0u; pass < 2u; ++pass) {
        wants_records = wants_records && count == 0u;
        barrier();
        if (thread == 0u) wanting = 0u;
        barrier();
        if (wants_records) atomicOr(wanting, 1u);
        barrier();
        if (wanting == 0u) break;
        for (uint base = tile_range[0]; base < tile_range[1]; base += BATCH) {
            uint size = min(BATCH, tile_range[1] - base);
            barrier();
            batch_bounds[thread] = 0u;
            if (thread < size) {
                uint record = sorted_pairs[base + thread].record;
                batch_records[thread] = record;
                batch_bounds[thread] = bounds_in_tile(rectangles[record], corner);
            }
            barrier();
            // Most records of a tile touch few of its pixels: two words give a pixel the candidates
            // among 32 records.
            uint transposed = 0u;
            for (uint i = 0u; i < 32u; ++i) {
                transposed |= ((batch_bounds[(thread & ~31u) + i] >> (thread & 31u)) & 1u) << i;
            }
            touching[thread] = transposed;
            barrier();
            if (!wants_records) continue;
            for (uint group = 0u; group < size; group += 32u) {
                uint records = touching[group + place.x] & touching[group + 16u + place.y];
                for (; records != 0u; records &= records - 1u) {
                    uint i = group + uint(findLSB(records));
                    CachePoint record = cache_point_at(CachePoints, batch_records[i]);
                    float weight = record_weight(pixel.position, pixel.normal, facet, record, tolerance);
                    if (weight <= 0.0) continue;
                    SplatWeight found = SplatWeight(batch_records[i], weight);
                    if (CROWDED == 0u && count < KEPT) kept[count] = found;
                    if (CROWDED == 1u && first + count < push.weight_capacity) weights[first + count] = found;
                    ++count;
                    sum += weight;
                }
            }
        }
        is_relaxed = wants_records && pass == 1u;
        tolerance = RELAXED;
    }
    if (is_relaxed) sum = -sum;
    if (CROWDED == 1u) {
        for (uint i = first; i < min(first + count, push.weight_capacity); ++i) weights[i].weight /= sum;
        if (!loops_completed(push.width)) tally.is_truncated = 1u;
        return;
    }
    // If pairs are missing, uncovered pixels cannot be determined; the host enlarges the list and
    // repeats the frame.
    bool is_complete = pair_offsets[push.record_count] <= push.pair_capacity;
    bool is_uncovered = is_relaxed && count == 0u && push.record_count > 0u && is_complete;
    if (is_uncovered) list_uncovered(index);
    if (is_relaxed && count > 0u) atomicAdd(tally.relaxed, 1u);

    uint capacity = is_uncovered ? 1u : count;
    if (capacity > 0u) first = atomicAdd(tile_weights, capacity);
    if (count > KEPT) atomicOr(crowding, 1u);
    barrier();
    if (thread == 0u) {
        tile_first = atomicAdd(tally.weights, tile_weights);
        if (crowding == 1u) list_crowded(tile);
    }
    barrier();
    if (!in_image) return;
    first += tile_first;
    weight_ranges[index] = WeightRange(first, first + capacity);
    for (uint i = 0u; i < min(count, KEPT) && first + i < push.weight_capacity; ++i) {
        weights[first + i] = SplatWeight(kept[i].record, kept[i].weight / sum);
    }
    if (!loops_completed(push.width)) tally.is_truncated = 1u;
}
