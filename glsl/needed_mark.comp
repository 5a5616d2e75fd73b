// Needed records, step 1: marks those that the splat weights of some pixel name. Deterministic: all who write a mark write the
// same. One invocation = one pixel. In: weights of a view. Out: marks of records.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/splat.glsl"

layout(local_size_x = 64) in;

struct NeededMarkPush {
    uint pixel_count;
    uint weight_capacity;
};

layout(scalar, binding = 0) readonly buffer FirstWeights { uint first_weights[]; };  // of each pixel, and the end
layout(scalar, binding = 1) readonly buffer Weights { SplatWeight weights[]; };
layout(scalar, binding = 2) writeonly buffer IsSeen { uint is_seen[]; };
layout(scalar, push_constant) uniform Push { NeededMarkPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uint end = min(first_weights[index + 1u], push.weight_capacity);
    for (uint i = first_weights[index]; i < end; ++i) is_seen[weights[i].record] = 1u;
}
