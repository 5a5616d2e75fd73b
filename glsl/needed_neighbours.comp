// Needed records, step 2: marks the stale records among the neighbours that blending reads for
// the seen records, or for all records. Deterministic: all writers of a mark write the same
// value. One invocation = one record. In: marks of seen records, lists of neighbours. Out: marks
// of records to gather.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/blend.glsl"

layout(local_size_x = 64) in;

struct NeededNeighboursPush {
    uint record_count;
    uint takes_all;  // 1: takes all records as seen
};

layout(scalar, binding = 0) readonly buffer IsSeen { uint is_seen[]; };
layout(scalar, binding = 1) readonly buffer IsCurrent { uint is_current[]; };
layout(scalar, binding = 2) readonly buffer NeighbourOffsets { uint neighbour_offsets[]; };  // CSR offsets: one for each record, and the end
layout(scalar, binding = 3) readonly buffer Neighbours { Neighbour neighbours[]; };
layout(scalar, binding = 4) writeonly buffer IsNeeded { uint is_needed[]; };  // initially zero
layout(scalar, push_constant) uniform Push { NeededNeighboursPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.record_count) return;
    bool is_asked = push.takes_all != 0u || is_seen[index] != 0u;
    uint end = is_asked ? neighbour_offsets[index + 1u] : 0u;
    for (uint i = neighbour_offsets[index]; i < end; ++i) {
        uint record = neighbours[i].record;
        if (is_current[record] == 0u) is_needed[record] = 1u;
    }
}
