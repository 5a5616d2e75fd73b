// Bright clusters: size of the dispatch that adds their light to listed records; no workgroup if
// nothing is bright. Deterministic. One invocation. In: offsets of watched clusters, number of
// listed records. Out: workgroups.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/bright.glsl"
#include "include/indirect.glsl"

layout(local_size_x = 1) in;

const uint RECORDS = 16u;  // of a workgroup of bright_rays.comp

struct BrightGroupsPush {
    uint record_count;  // of all, listed or not
    uint watched_count;
    uint rays;          // of a record
};

layout(scalar, binding = 0) readonly buffer BrightOffsets { uint bright_offsets[]; };  // prefix sum of the weights, and the total
layout(scalar, binding = 1) readonly buffer BrightStates { BrightState bright_state[]; };
layout(scalar, binding = 2) readonly buffer RecordOffsets { uint record_offsets[]; };
layout(scalar, binding = 3) writeonly buffer BrightGroups { uint bright_groups[]; };
layout(scalar, push_constant) uniform Push { BrightGroupsPush push; };

void main() {
    // Without a bright cluster the sum of all weights is zero.
    bool are_bright = bright_state[0].is_on != 0u && bright_offsets[push.watched_count] >= push.rays;
    uint groups = are_bright ? (record_offsets[push.record_count] + RECORDS - 1u) / RECORDS : 0u;
    for (uint axis = 0u; axis < 3u; ++axis) bright_groups[axis] = swizzled(groups)[axis];
}
