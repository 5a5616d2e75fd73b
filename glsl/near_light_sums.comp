// Near-light correction, step 3: sums the weights of the entry points that share a hit's light.
// Deterministic: the points have a fixed order. One invocation = one hit. In: hits, entry points.
// Out: the sum of each hit.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/near_lights.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = 0) readonly buffer NearPoints { NearPoint near_points[]; };
layout(scalar, binding = 1) readonly buffer NearStates { NearState near_states[]; };
layout(scalar, binding = 2) readonly buffer SeenPoints { uint seen_points[]; };
layout(scalar, binding = 3) buffer NearHits { NearHit near_hits[]; };
layout(scalar, push_constant) uniform Push { NearLightsPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.ray_count || strength(push, near_states[0].nearest) == 0.0) return;
    NearHit hit = near_hits[index];
    if (hit.flux == 0.0) return;
    float sum = hit.sum;
    for (uint i = push.first_point; i < push.end_point; ++i) {
        if (seen_points[i] != 0u) sum += weight_of(push, hit, near_points[i]) * near_points[i].area_m2;
    }
    near_hits[index].sum = sum;
}
