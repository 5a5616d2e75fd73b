// Replaces each record by a weighted mean of its neighbours, which their gradients extrapolate to
// its position. The records' sampling noise is independent and averages out. The light is smooth
// between points that see each other and stays. Neighbours and weights depend on geometry alone: a
// constant sparse matrix. Deterministic. One invocation = one record. In: records, lists of
// (neighbour, weight) whose weights sum to 1. Out: blended records.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/blend.glsl"

layout(local_size_x = 64) in;

struct BlendPush {
    uint record_count;
    uint takes_all;  // 0: only records that the view sees
};

layout(binding = 0) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 1) readonly buffer NeighbourOffsets { uint neighbour_offsets[]; };  // CSR offsets: one for each record, and the end
layout(scalar, binding = 2) readonly buffer Neighbours { Neighbour neighbours[]; };
layout(binding = 3) uniform usamplerBuffer Records;  // `Record`s
layout(scalar, binding = 4) writeonly buffer Blended { Record blended[]; };
layout(scalar, binding = 5) readonly buffer IsSeen { uint is_seen[]; };
layout(scalar, push_constant) uniform Push { BlendPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.record_count || (push.takes_all == 0u && is_seen[index] == 0u)) return;
    CachePoint point = cache_point_at(CachePoints, index);
    vec3 irradiance = vec3(0.0);
    vec3 offset = vec3(0.0);
    mat3 translation = mat3(0.0);
    mat3 rotation = mat3(0.0);
    for (uint i = neighbour_offsets[index]; i < neighbour_offsets[index + 1u]; ++i) {
        Record record = record_at(Records, neighbours[i].record);
        float weight = neighbours[i].weight;
        // Trapezoidal rule: half of the offset by the neighbour's gradient here, half by the
        // record's own gradient below, so that the curvature terms cancel.
        vec3 moved = point.position - record.position;
        vec3 change = 0.5 * moved * record.translation + point.normal * record.rotation;
        irradiance += weight * max(record.irradiance + change, vec3(0.0));
        offset += weight * moved;
        translation += weight * record.translation;
        rotation += weight * record.rotation;
    }
    irradiance = max(irradiance + 0.5 * offset * translation, vec3(0.0));
    // A rotational gradient lies in the tangent plane of the record. The component of the mean
    // along the record's normal is no rotation.
    rotation -= outerProduct(point.normal, point.normal * rotation);
    blended[index] = Record(point.position, irradiance, translation, rotation);
}
