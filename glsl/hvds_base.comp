// Base level of the volumetric hierarchy: each cluster adds up what the light paths deposit in it, light that came straight
// from the lights apart from light that came from surfaces. [Yue §2] Deterministic: the lists have a fixed order.
// One invocation = one base cluster. In: deposits, path flux (W). Out: flux (W).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/hvds.glsl"

layout(local_size_x = 64) in;

struct HvdsBasePush {
    uint first_cluster;  // of the base level
    uint cluster_count;
};

layout(scalar, binding = 0) readonly buffer PathFlux { vec3 path_flux[]; };
layout(scalar, binding = 1) readonly buffer FirstDeposits { uint first_deposits[]; };  // entry points' and others' of each cluster
layout(scalar, binding = 2) readonly buffer Deposits { Deposit deposits[]; };
layout(scalar, binding = 3) writeonly buffer ClusterFluxes { ClusterFlux cluster_fluxes[]; };
layout(scalar, push_constant) uniform Push { HvdsBasePush push; };

vec3 deposited(uint list) {
    vec3 flux = vec3(0.0);
    for (uint i = first_deposits[list]; i < first_deposits[list + 1u]; ++i) {
        flux += deposits[i].throughput * path_flux[deposits[i].path];
    }
    return flux;
}

void main() {
    uint index = flat_invocation();
    if (index >= push.cluster_count) return;
    cluster_fluxes[push.first_cluster + index] = ClusterFlux(deposited(2u * index), deposited(2u * index + 1u));
}
