// One coarser level of the volumetric hierarchy: a cluster's flux is the sum of its children's.
// Radiances are never averaged. [Yue §2] Deterministic. One invocation = one listed cluster of the
// level. In: flux one level down (W). Out: flux (W).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/hvds.glsl"

layout(local_size_x = 64) in;

struct HvdsLevelPush {
    uint first_listed;  // of the level, in the list
    uint cluster_count;
    uint base_count;    // clusters without children, which come first
};

layout(scalar, binding = 0) readonly buffer ChildOffsets { uint child_offsets[]; };  // of each cluster above the base, and the end
layout(scalar, binding = 1) readonly buffer Children { uint children[]; };
layout(scalar, binding = 2) buffer ClusterFluxes { ClusterFlux cluster_fluxes[]; };
layout(scalar, binding = 3) readonly buffer SummedClusters { uint summed_clusters[]; };
layout(scalar, push_constant) uniform Push { HvdsLevelPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.cluster_count) return;
    uint cluster = summed_clusters[push.first_listed + index];
    ClusterFlux sum = ClusterFlux(vec3(0.0), vec3(0.0));
    uint above = cluster - push.base_count;
    for (uint i = child_offsets[above]; i < child_offsets[above + 1u]; ++i) {
        uint child = children[i];
        sum.direct += cluster_fluxes[child].direct;
        sum.indirect += cluster_fluxes[child].indirect;
    }
    cluster_fluxes[cluster] = sum;
}
