// Own records: gives pixels and edge points that gather for themselves the irradiance of their own
// records. Deterministic. One invocation = one own record. In: records, places. Out: irradiance,
// W/m².
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct OwnRecordsPush {
    uint record_count;
};

layout(binding = 0) uniform usamplerBuffer Records;  // `Record`s
layout(scalar, binding = 1) readonly buffer OwnPlaces { uint own_places[]; };  // of each record: 2·pixel, or 2·edge point + 1
layout(scalar, binding = 2) writeonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };  // of pixels
layout(scalar, binding = 3) writeonly buffer EdgeIrradiance { vec3 edge_irradiance[]; };          // of edge points
layout(scalar, push_constant) uniform Push { OwnRecordsPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.record_count) return;
    uint place = own_places[index];
    vec3 irradiance = record_at(Records, index).irradiance;
    if ((place & 1u) == 0u) indirect_irradiance[place >> 1] = irradiance;
    else edge_irradiance[place >> 1] = irradiance;
}
