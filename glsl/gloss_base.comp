// Outgoing directions of shining base clusters: π times what the Phong lobes of their path vertices send there. [Yue §2]
// Deterministic: the lists have a fixed order. One invocation = one direction of one base cluster.
// In: beams at entry points, deposits, path flux (W). Out: W, as much as a Lambertian surface of albedo 1 would have to receive.
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

struct GlossBasePush {
    uint slot_count;  // of the base level
    uint beam_count;  // of an entry point
    uvec2 window;     // vertices of this dispatch, of each cluster: first, and how many
};

layout(scalar, binding = 0) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 1) readonly buffer ReflectedFlux { vec3 reflected_flux[]; };
layout(scalar, binding = 2) readonly buffer FirstDeposits { uint first_deposits[]; };  // entry points' and others' of each cluster
layout(scalar, binding = 3) readonly buffer Deposits { Deposit deposits[]; };
layout(scalar, binding = 4) readonly buffer GlossVertices { GlossVertex gloss_vertices[]; };
layout(scalar, binding = 5) readonly buffer GlossBeams { GlossBeam gloss_beams[]; };
layout(scalar, binding = 6) readonly buffer GlossSlots { GlossSlot gloss_slots[]; };
layout(scalar, binding = 7) readonly buffer Directions { vec3 directions[]; };
layout(scalar, binding = 8) buffer GlossFluxes { vec3 gloss_fluxes[]; };
layout(scalar, push_constant) uniform Push { GlossBasePush push; };

#include "include/gloss_flux.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.slot_count) return;
    GlossSlot slot = gloss_slots[index];
    vec3 before = push.window.x == 0u ? vec3(0.0) : gloss_fluxes[index];
    vec3 toward = directions[slot.direction];
    gloss_fluxes[index] = before + gloss_flux(slot.cluster, slot.shift, toward, push.beam_count, push.window);
}
