// Lobes at records, step 1: marks the records from which pixels take the light of a broad lobe.
// Deterministic. One invocation = one pixel. In: surfaces at the pixels, fragments, splat weights.
// Out: 1 for a record that is read.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct GlossReadPush {
    EdgeCapacity edge_capacity;
    uint width;
    uint height;
    uint weight_capacity;
    uint broad_exponents;  // see `is_broad`
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 1) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 2) uniform usamplerBuffer Pixels;
layout(scalar, binding = 3) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 4) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(binding = 5) uniform usamplerBuffer Fragments;
layout(binding = 6) uniform usamplerBuffer FragmentSurfaces;
layout(binding = 7) uniform usamplerBuffer WeightRanges;  // of each pixel
layout(binding = 8) uniform usamplerBuffer EdgeWeightRanges;  // of each edge point
layout(binding = 9) uniform usamplerBuffer Weights;
layout(scalar, binding = 10) writeonly buffer IsRead { uint is_read[]; };
layout(scalar, push_constant) uniform Push { GlossReadPush push; };

#include "include/surfaces.glsl"
#include "include/seen_fragments.glsl"
#include "include/record_ranges.glsl"

bool is_broad_side(uint side) { return side != NO_SIDE && is_broad(materials[surface_at(side >> 1).material], push.broad_exponents); }

void mark(uvec2 range) {
    for (uint i = range.x; i < min(range.y, push.weight_capacity); ++i) is_read[pair_at(Weights, i).x] = 1u;
}

void main() {
    uint index = flat_invocation();
    uvec2 size = uvec2(push.width, push.height);
    if (index >= size.x * size.y) return;
    SeenFragments shown = fragments_of(index, size.x * size.y, push.edge_capacity);
    if (!shown.is_edge && is_broad_side(pixel_surface_at(Pixels, index).side)) mark(pair_at(WeightRanges, index));
    for (uint i = shown.first; i < shown.end; ++i) {
        if (is_broad_side(pixel_surface_at(FragmentSurfaces, i).side)) mark(weights_of(fragment_at(Fragments, i), index, size));
    }
}
