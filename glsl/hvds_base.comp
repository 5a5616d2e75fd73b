// Base level of the volumetric hierarchy: each cluster adds up what the light paths deposit in it, light that came straight
// from the lights apart from light that came from surfaces. [Yue §2] Deterministic: the lists have a fixed order.
// One invocation = one listed base cluster. In: deposits, path flux (W). Out: flux (W).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/hvds.glsl"

layout(local_size_x = 64) in;

struct HvdsBasePush {
    uint first_place;  // of the base level, in the list
    uint cluster_count;
};

layout(scalar, binding = 0) readonly buffer PathFlux { vec3 path_flux[]; };
layout(scalar, binding = 1) readonly buffer ReflectedFlux { vec3 reflected_flux[]; };   // the same behind the entry point
layout(scalar, binding = 2) readonly buffer FirstDeposits { uint first_deposits[]; };  // entry points' and others' of each cluster
layout(scalar, binding = 3) readonly buffer Deposits { Deposit deposits[]; };
layout(scalar, binding = 4) writeonly buffer ClusterFluxes { ClusterFlux cluster_fluxes[]; };
layout(scalar, binding = 5) readonly buffer SummedClusters { uint summed_clusters[]; };
layout(scalar, push_constant) uniform Push { HvdsBasePush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.cluster_count) return;
    uint cluster = summed_clusters[push.first_place + index];
    ClusterFlux flux = ClusterFlux(vec3(0.0), vec3(0.0));
    uint first_other = first_deposits[2u * cluster + 1u];
    for (uint i = first_deposits[2u * cluster]; i < first_other; ++i) {
        flux.direct += deposits[i].throughput * path_flux[deposits[i].path];
    }
    for (uint i = first_other; i < first_deposits[2u * cluster + 2u]; ++i) {
        flux.indirect += deposits[i].throughput * reflected_flux[deposits[i].path];
    }
    cluster_fluxes[cluster] = flux;
}
