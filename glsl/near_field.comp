// Near field: clusters that are smaller than what path vertices resolve, and parts of them that a
// near cache point sees, take their indirect light from the record that was gathered beside them,
// ahead of all others, moved to their middle by its gradient; what the picture shows is gathered
// behind. A record's rays see the narrow surroundings that a cluster averages away. Before there
// are records, parts are like their clusters. Deterministic. One invocation = one such cluster or
// part. In: cluster flux (W), records. Out: irradiance, W/m².
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/hvds.glsl"

layout(local_size_x = 64) in;

struct NearCluster {
    uint cluster;
    uint record;  // that speaks for it
    vec3 offset;  // from the record to the middle of the cluster, or of its part, metres
    uint target;  // whose irradiance it is: the cluster's, or behind all clusters a part's
};
struct NearFieldPush {
    uint near_count;
    uint has_records;
};

layout(scalar, binding = 0) readonly buffer NearClusters { NearCluster near_clusters[]; };
layout(scalar, binding = 1) readonly buffer InverseAreas { float inverse_areas[]; };  // 1/m²
layout(binding = 2) uniform usamplerBuffer ClusterFluxes;
layout(binding = 3) uniform usamplerBuffer Records;
layout(scalar, binding = 4) buffer Irradiance { vec3 irradiance[]; };
layout(scalar, push_constant) uniform Push { NearFieldPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.near_count) return;
    NearCluster near = near_clusters[index];
    if (push.has_records == 0u) {
        irradiance[near.target] = irradiance[near.cluster];
        return;
    }
    Record record = record_at(Records, near.record);
    // Irradiance is never negative; a linear extrapolation can be.
    vec3 indirect = max(record.irradiance + near.offset * record.translation, vec3(0.0));
    irradiance[near.target] = cluster_flux_at(ClusterFluxes, near.cluster).direct * inverse_areas[near.cluster] + indirect;
}
