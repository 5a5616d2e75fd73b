// Lobes at records, step 1: marks the records that pixels with a broad lobe read. Deterministic.
// One invocation = one pixel. In: surfaces at the pixels, splat weights. Out: 1 for a record that
// is read.
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

layout(local_size_x = 64) in;

struct GlossReadPush {
    uint pixel_count;
    uint weight_capacity;
    uint broad_exponents;  // see `is_broad`
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 1) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 2) uniform usamplerBuffer Pixels;
layout(binding = 3) uniform usamplerBuffer WeightRanges;  // of each pixel
layout(binding = 4) uniform usamplerBuffer Weights;
layout(scalar, binding = 5) writeonly buffer IsRead { uint is_read[]; };
layout(scalar, push_constant) uniform Push { GlossReadPush push; };

#include "include/surfaces.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uint side = pixel_surface_at(Pixels, index).side;
    if (side == NO_SIDE || !is_broad(materials[surface_at(side >> 1).material], push.broad_exponents)) return;
    uvec2 range = pair_at(WeightRanges, index);
    for (uint i = range.x; i < min(range.y, push.weight_capacity); ++i) is_read[pair_at(Weights, i).x] = 1u;
}
