// Needed records, step 1: marks the records that the splat weights of a view use. Deterministic:
// all writers of a mark write the same value. One invocation = one pixel. In: weights of a view.
// Out: marks of records.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct NeededMarkPush {
    uint pixel_count;
    uint weight_capacity;
};

layout(binding = 0) uniform usamplerBuffer WeightRanges;  // of each pixel
layout(binding = 1) uniform usamplerBuffer Weights;     // `SplatWeight`s
layout(scalar, binding = 2) writeonly buffer IsSeen { uint is_seen[]; };
layout(scalar, push_constant) uniform Push { NeededMarkPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uvec2 range = pair_at(WeightRanges, index);
    for (uint i = range.x; i < min(range.y, push.weight_capacity); ++i) is_seen[pair_at(Weights, i).x] = 1u;
}
