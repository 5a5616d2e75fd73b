// Base level of the volumetric hierarchy: flux of the path vertices in each cluster, over its area. [Yue §2]
// Deterministic: every sum runs over a stored list in its order. One invocation = one base cluster.
// In: path flux (W), deposits in cluster order. Out: flux (W) and irradiance (W/m²) of the cluster.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct HvdsBasePush {
    uint first_cluster;  // of the base level
    uint cluster_count;
};

layout(scalar, binding = 0) readonly buffer PathFlux { vec3 path_flux[]; };
layout(scalar, binding = 1) readonly buffer FirstDeposits { uint first_deposits[]; };  // of each base cluster, and the end
layout(scalar, binding = 2) readonly buffer Deposits { Deposit deposits[]; };
layout(scalar, binding = 3) readonly buffer InverseAreas { float inverse_areas[]; };   // 1/m²
layout(scalar, binding = 4) writeonly buffer ClusterFlux { vec3 cluster_flux[]; };
layout(scalar, binding = 5) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(scalar, push_constant) uniform Push { HvdsBasePush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.cluster_count) return;
    vec3 flux = vec3(0.0);
    for (uint i = first_deposits[index]; i < first_deposits[index + 1u]; ++i) {
        flux += deposits[i].throughput * path_flux[deposits[i].path];
    }
    uint cluster = push.first_cluster + index;
    cluster_flux[cluster] = flux;
    irradiance[cluster] = flux * inverse_areas[cluster];
}
