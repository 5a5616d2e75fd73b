// Near field: indirect light of clusters that path vertices do not resolve, and of near-field
// patches. Both take it from the nearest record, extrapolated to their middle by its gradient:
// the record's rays see narrow surroundings that a cluster averages away. These records are
// gathered first; the records of the image follow. Before the first gather a patch copies its
// cluster. Deterministic. One invocation = one such cluster or patch. In: cluster flux (W),
// records. Out: irradiance, W/m².
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
    uint record;  // the record beside it
    vec3 offset;  // from the record to the middle of the cluster or patch, metres
    uint target;  // index of the result: the cluster, or the patch behind all clusters
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
