// Needed records, step 3: lists the needed records in order, marks them as current, and sizes the
// dispatches that gather them, one for each buffer of the split table of gather rays.
// Deterministic. One invocation = one record. In: exclusive prefix sum of the marks, and the total.
// Out: indices of needed records, marks of current records, dispatch sizes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/record_lanes.glsl"

layout(local_size_x = 64) in;

struct NeededListPush {
    uint record_count;
    uint records_per_chunk;  // records of one buffer of the table
};

layout(scalar, binding = 0) readonly buffer RecordOffsets { uint record_offsets[]; };
layout(scalar, binding = 1) writeonly buffer ListedRecords { uint listed_records[]; };
layout(scalar, binding = 2) writeonly buffer IsCurrent { uint is_current[]; };
layout(scalar, binding = 3) writeonly buffer GatherGroups { uint gather_groups[]; };  // three words for each buffer of the table
layout(scalar, push_constant) uniform Push { NeededListPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.record_count) return;
    uint place = record_offsets[index];
    if (record_offsets[index + 1u] != place) {
        listed_records[place] = index;
        is_current[index] = 1u;
    }
    if (index % push.records_per_chunk == 0u) {
        uint chunk = index / push.records_per_chunk;
        uint records = record_offsets[min(index + push.records_per_chunk, push.record_count)] - place;
        uint groups = (records + RECORDS - 1u) / RECORDS;
        for (uint axis = 0u; axis < 3u; ++axis) gather_groups[3u * chunk + axis] = swizzled(groups)[axis];
    }
}
