// Splatting, step 1: the records that serve each pixel, and their weights. [Yue §4, Tabellion] A
// pixel's weights are deterministic, because lists have a fixed order; the position of its
// segment is not, because workgroups allocate in any order. A pixel keeps up to KEPT weights in
// registers until their number is known; if it has more, it weighs them again. One workgroup = one
// tile of 8×8 pixels. In: pixels, record tree. Out: segments of (record, weight) whose weights sum
// to 1; uncovered pixels, each with space for one weight.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/quirks.glsl"
#include "include/splat.glsl"
#include "include/records.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint AT_EDGES = 0;  // 1: the pixels are edge points, in any order

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(binding = 1) uniform usamplerBuffer Pixels;
layout(binding = 2) uniform usamplerBuffer CachePoints;
layout(binding = 3) uniform usamplerBuffer TreeCells;
layout(binding = 4) uniform usamplerBuffer RecordLists;  // of each cell: the number of its own records, then these
layout(scalar, binding = 5) writeonly buffer WeightRanges { WeightRange weight_ranges[]; };  // of each pixel
layout(scalar, binding = 6) writeonly buffer Weights { SplatWeight weights[]; };
layout(scalar, binding = 7) buffer Tally { SplatTally tally; };
// Workgroups along each axis, for 64 items each; the number of items; the items, in any order,
// because each is handled by itself.
layout(scalar, binding = 8) buffer UncoveredPixels { uint uncovered_pixels[]; };
layout(scalar, binding = 9) readonly buffer PointGroups { uint point_groups[]; };  // word 3: number of edge points

#include "include/surfaces.glsl"
#include "include/record_tree.glsl"

struct SplatWeightsPush {
    TreeGrid grid;
    uint width;
    uint height;
    uint record_count;
    uint weight_capacity;
};
layout(scalar, push_constant) uniform Push { SplatWeightsPush push; };

const uint KEPT = 8u;  // weights of a pixel in registers
shared uint tile_weights;  // their number
shared uint tile_first;    // index of the first one
shared uint tile_weighed;  // records that the tile's pixels weighed

void list_uncovered(uint pixel) {
    uint place = atomicAdd(uncovered_pixels[3], 1u);
    uncovered_pixels[4u + place] = pixel;
    for (uint axis = 0u; axis < 3u; ++axis) atomicMax(uncovered_pixels[axis], swizzled((place + 64u) / 64u)[axis]);
}

// Records with weight at a pixel.
struct Served {
    uint weighed;  // records, these among them
    uint count;
    float sum;  // of the weights
    SplatWeight kept[KEPT];  // the first ones
};

// `place` and `scale` are of a list in memory that takes all weights; KEEPS: none does.
const uint KEEPS = 0xffffffffu;

Served weigh(PixelSurface pixel, vec3 facet, uint root, Tolerance tolerance, uint place, float scale) {
    Served served;
    served.weighed = 0u;
    served.count = 0u;
    served.sum = 0.0;
    for (TreeWalk walk = walk_from(push.grid, root, pixel.position); walk.cell != EMPTY;) {
        uint list = next_list(walk);
        uint length = list == EMPTY ? 0u : word_at(RecordLists, list);
        uint end = list + 1u + length;
        served.weighed += length;
        for (uint i = list + 1u; i < end; ++i) {
            uint record = word_at(RecordLists, i);
            float weight = record_weight(pixel.position, pixel.normal, facet, cache_point_at(CachePoints, record), tolerance);
            if (weight <= 0.0) continue;
            SplatWeight found = SplatWeight(record, weight);
            if (place == KEEPS && served.count < KEPT) served.kept[served.count] = found;
            if (place != KEEPS && place + served.count < push.weight_capacity) weights[place + served.count] = SplatWeight(record, weight * scale);
            ++served.count;
            served.sum += weight;
        }
    }
    return served;
}

void main() {
    if (gl_LocalInvocationIndex == 0u) tile_weights = tile_weighed = 0u;
    barrier();
    uvec2 xy = corner_of_tile(flat_workgroup(), 8u, push.width) + place_in_tile(8u);
    bool is_inside = xy.x < push.width && xy.y < push.height;
    uint index = xy.y * push.width + xy.x;
    if (AT_EDGES == 1u) {
        index = flat_invocation();
        is_inside = index < point_groups[3];
    }
    PixelSurface pixel = PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);
    if (is_inside) pixel = pixel_surface_at(Pixels, index);
    // An inactive side receives no indirect light and has no records.
    bool wants_records = false;
    vec3 facet = vec3(0.0);
    if (pixel.side != NO_SIDE) {
        Surface surface = surface_at(pixel.side >> 1);
        wants_records = side_is_active(surface.sides, (pixel.side & 1u) != 0u);
        facet = facet_of(surface, pixel.side);
    }
    Tolerance tolerance = VALID;
    uint root = push.grid.valid;
    Served served = weigh(pixel, facet, wants_records ? root : EMPTY, tolerance, KEEPS, 0.0);
    bool is_valid = served.count > 0u;
    bool is_relaxed = wants_records && served.sum < MIN_WEIGHT;
    uint weighed = served.weighed;
    if_any (is_relaxed) {
        tolerance = RELAXED;
        root = push.grid.relaxed;
        served = weigh(pixel, facet, root, tolerance, KEEPS, 0.0);
        served.sum = -served.sum;
        weighed += served.weighed;
    }
    bool is_uncovered = is_relaxed && served.count == 0u && push.record_count > 0u;
    if (is_uncovered) list_uncovered(index);
    if (is_relaxed && !is_valid && served.count > 0u) atomicAdd(tally.relaxed, 1u);

    uint capacity = is_uncovered ? 1u : served.count;
    uint first = 0u;
    if (capacity > 0u) first = atomicAdd(tile_weights, capacity);
    if (weighed > 0u) atomicAdd(tile_weighed, weighed);
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        tile_first = atomicAdd(tally.weights, tile_weights);
        atomicAdd(tally.weighed, tile_weighed);
    }
    barrier();
    if (!is_inside && AT_EDGES == 0u) return;
    first += tile_first;
    weight_ranges[index] = WeightRange(first, first + capacity);
    float scale = 1.0 / served.sum;
    if (served.count <= KEPT) {
        for (uint i = 0u; i < served.count && first + i < push.weight_capacity; ++i) {
            weights[first + i] = SplatWeight(served.kept[i].record, served.kept[i].weight * scale);
        }
    }
    if_any (served.count > KEPT) weigh(pixel, facet, root, tolerance, first, scale);
    if (!loops_completed(push.width)) tally.is_truncated = 1u;
}
