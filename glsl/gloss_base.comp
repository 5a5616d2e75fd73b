// Outgoing directions of shining clusters: π times what the Phong lobes of their path vertices send there, of light from surfaces, or
// straight from one light, per unit of its emission. [Yue §2]
// Deterministic: the lists have a fixed order. One invocation = one direction of one cluster.
// In: beams of a light at entry points, or deposits and flux of paths (W).
// Out: W, as much as a Lambertian surface of albedo 1 would have to receive.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ENTRY_POINTS = 0;  // 1: light straight from one light; 0: light from surfaces

layout(scalar, binding = 0) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 1) readonly buffer ReflectedFlux { vec3 reflected_flux[]; };
layout(scalar, binding = 2) readonly buffer FirstDeposits { uint first_deposits[]; };  // entry points' and others' of each cluster
layout(scalar, binding = 3) readonly buffer Deposits { Deposit deposits[]; };
layout(scalar, binding = 4) readonly buffer GlossVertices { GlossVertex gloss_vertices[]; };
layout(scalar, binding = 5) readonly buffer GlossBeams { GlossBeam gloss_beams[]; };
layout(scalar, binding = 6) readonly buffer GlossSlots { GlossSlot gloss_slots[]; };
layout(scalar, binding = 7) readonly buffer BaseRanges { uvec2 base_ranges[]; };   // base clusters below each cluster
layout(scalar, binding = 8) readonly buffer GlossShifts { uint gloss_shifts[]; };  // of each base cluster; NO_ENTRY: does not shine
layout(scalar, binding = 9) buffer GlossFluxes { vec3 gloss_fluxes[]; };

#include "include/gloss_flux.glsl"

struct GlossBasePush {
    GlossPart part;
    uint slot_count;  // that are not sums of others: the first so many
};
layout(scalar, push_constant) uniform Push { GlossBasePush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.slot_count) return;
    GlossSlot slot = gloss_slots[index];
    vec3 before = push.part.adds != 0u ? gloss_fluxes[index] : vec3(0.0);
    gloss_fluxes[index] = before + gloss_flux_below(slot.cluster, slot.direction, push.part);
}
