// Splatting, step 2: gives each uncovered pixel the best-fitting record of all. The search skips
// nodes of the tree whose records cannot fit better than the best so far. Deterministic: of equal
// records the first wins. One invocation = one pixel. In: uncovered pixels, records, tree of
// nearest records. Out: the pixel's only weight.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/splat.glsl"

layout(local_size_x = 64) in;

struct SplatNearestPush {
    uint node_count;
    uint weight_capacity;
};

layout(binding = 0) uniform usamplerBuffer Pixels;
layout(binding = 1) uniform usamplerBuffer CachePoints;
layout(binding = 2) uniform usamplerBuffer NearestNodes;
layout(binding = 3) uniform usamplerBuffer NearestOrder;  // records, in the order of the leaves
layout(scalar, binding = 4) readonly buffer WeightRanges { WeightRange weight_ranges[]; };
layout(scalar, binding = 5) readonly buffer UncoveredPixels { uint uncovered_pixels[]; };  // see splat_weights
layout(scalar, binding = 6) writeonly buffer Weights { SplatWeight weights[]; };
layout(scalar, binding = 7) writeonly buffer Tally { SplatTally tally; };
layout(scalar, push_constant) uniform Push { SplatNearestPush push; };

const uint NONE = 0xffffffffu;
const uint COUNT_BITS = 3u;  // as in src/passes/frame/nearest_records.rs

// The best-fitting record so far.
struct Best {
    float misfit;
    uint record;
};

// Misfit of a record: grows with the distance and the angle, and is at least the distance.
float misfit(PixelSurface pixel, uint record) {
    CachePoint point = cache_point_at(CachePoints, record);
    return distance(pixel.position, point.position) * (20.0 - 19.0 * dot(pixel.normal, point.normal));
}

uvec4 node_texel(uint node, uint texel) { return texelFetch(NearestNodes, int(4u * node + texel)); }

// The node after another and all below it.
uint after(uint node) { return node_texel(node, 0u).w; }

// Number of records of a leaf, and above COUNT_BITS the first one's place; zero: no leaf.
uint records_of(uint node) { return node_texel(node, 1u).w; }

// A lower bound of the misfit of a node's records, despite rounding.
float min_misfit(PixelSurface pixel, uint node) {
    vec3 low = numbers(node_texel(node, 0u)).xyz;
    vec3 high = numbers(node_texel(node, 1u)).xyz;
    vec3 facing = max(pixel.normal * numbers(node_texel(node, 2u)).xyz, pixel.normal * numbers(node_texel(node, 3u)).xyz);
    float away = length(max(max(low - pixel.position, pixel.position - high), vec3(0.0)));
    return 0.9999 * away * (20.0 - 19.0 * min(facing.x + facing.y + facing.z, 1.0));
}

void compare_leaf(PixelSurface pixel, uint records, inout Best best) {
    uint first = records >> COUNT_BITS;
    for (uint i = first; i < first + (records & (1u << COUNT_BITS) - 1u); ++i) {
        Best found = Best(0.0, word_at(NearestOrder, i));
        found.misfit = misfit(pixel, found.record);
        bool is_better = found.misfit < best.misfit || (found.misfit == best.misfit && found.record < best.record);
        if (is_better) best = found;
    }
}

void main() {
    uint number = flat_invocation();
    if (number >= uncovered_pixels[3]) return;
    uint index = uncovered_pixels[4u + number];
    PixelSurface pixel = pixel_surface_at(Pixels, index);
    Best best = Best(1e30, NONE);
    // The leaf behind the better child each time gives an upper bound of the misfit.
    uint node = 0u;
    while (records_of(node) == 0u) {
        uint left = node + 1u;
        uint right = after(left);
        node = min_misfit(pixel, left) <= min_misfit(pixel, right) ? left : right;
    }
    compare_leaf(pixel, records_of(node), best);
    for (node = 0u; node < push.node_count;) {
        bool is_far = min_misfit(pixel, node) > best.misfit;
        if (!is_far) compare_leaf(pixel, records_of(node), best);
        node = is_far ? after(node) : node + 1u;
    }
    uint place = weight_ranges[index].first;
    if (place < push.weight_capacity) weights[place] = SplatWeight(best.record, -1.0);
    if (!loops_completed(push.node_count)) tally.is_truncated = 1u;
}
