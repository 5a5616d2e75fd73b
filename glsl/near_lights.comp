// Near-light correction, step 4: corrects the form factors near a light that is closer to a surface
// than the spacing of entry points. Deterministic: the hits have a fixed order. One invocation =
// one entry point. In: hits, entry points. Out: the light's form factors.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/near_lights.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = 0) readonly buffer NearPoints { NearPoint near_points[]; };
layout(scalar, binding = 1) readonly buffer NearStates { NearState near_states[]; };
layout(scalar, binding = 2) readonly buffer SeenPoints { uint seen_points[]; };
layout(scalar, binding = 3) readonly buffer NearHits { NearHit near_hits[]; };
layout(scalar, binding = 4) buffer FormFactors { float form_factors[]; };
layout(scalar, push_constant) uniform Push { NearLightsPush push; };

void main() {
    uint index = flat_invocation();
    float strength = strength(push, near_states[0].nearest);
    if (index >= push.point_count || strength == 0.0) return;
    NearPoint point = near_points[index];
    float added = 0.0;
    for (uint i = 0u; i < push.ray_count && seen_points[index] != 0u; ++i) {
        NearHit hit = near_hits[i];
        if (hit.sum > 0.0) added += weight_of(push, hit, point) / hit.sum * fraction_of_rays(push, strength, hit.distance) * hit.flux;
    }
    float distance = distance(point.position, push.light_position);
    float by_rays = fraction_of_rays(push, strength, distance);
    // The clamp of 1/d² loses light, which the correction restores here.
    float excess = distance < REACH * push.mean_spacing ? strength * push.area_m2 / PI / (distance * distance) : 0.0;
    float kept = by_rays < 1.0 ? (1.0 - by_rays) * (1.0 + excess) : 0.0;
    if (kept != 1.0 || added != 0.0) form_factors[point.index] = kept * form_factors[point.index] + added;
}
