// Direct light at the measuring points of light meters: irradiance per unit of a light's emission.
// Deterministic. One invocation = one point. In: measuring points, a light. Out: its irradiance at
// each point; light_factor gives the units. Points in solids, of radius zero, are dark.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"

layout(local_size_x = 64) in;

struct MetersPush {
    uint point_count;
    uint light;
    uint first_sample;  // first sample in this dispatch; later dispatches add to the first
    uint end_sample;
    uint flags;         // ADDS
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Lights;
layout(scalar, binding = 4) readonly buffer MeasuringPoints { CachePoint measuring_points[]; };
layout(scalar, binding = 5) buffer LightIrradiance { float light_irradiance[]; };
layout(scalar, binding = 6) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { MetersPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_kind.glsl"
#include "include/direct.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.point_count) return;
    LightSource light = of_kind(light_at(Lights, push.light));
    CachePoint point = measuring_points[index];
    uint end = end_of_kind(push.first_sample, push.end_sample);
    float lit = 0.0;
    if_any (point.radius > 0.0) lit = light_factor(light, push.first_sample, end, push.flags, point.position, point.facet, point.normal, 0.0);
    float before = is_first(push.flags, push.first_sample) ? 0.0 : light_irradiance[index];
    light_irradiance[index] = accumulated(light, push.flags, push.end_sample, before, lit, point.position, point.normal, 0.0);
    if (!loops_completed(push.point_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
