// Near-light correction, step 2: tests which entry points see the light from above their surface;
// a wall between them and the light blocks it. Deterministic. One invocation = one entry point near
// the light. In: entry points. Out: 1 if the point sees the light, else 0.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/near_lights.glsl"

layout(local_size_x = 64) in;

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer NearPoints { NearPoint near_points[]; };
layout(scalar, binding = 4) readonly buffer NearStates { NearState near_states[]; };
layout(scalar, binding = 5) writeonly buffer SeenPoints { uint seen_points[]; };
layout(scalar, binding = 6) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { NearLightsPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.point_count || strength(push, near_states[0].nearest) == 0.0) return;
    NearPoint point = near_points[index];
    vec3 over = uintBitsToFloat(near_states[0].height) * point.normal;
    Hit hit;
    bool is_hidden = trace(Ray(push.light_position + over, point.position - push.light_position, 1.0), true, hit);
    seen_points[index] = is_hidden ? 0u : 1u;
    if (!loops_completed(push.point_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
