// Irradiance of the clusters: flux over area. Light from surfaces is noisier and smoother
// than light from the lights. It comes from the smallest enclosing cluster that reaches the
// minimum sample count. Deterministic. One invocation = one listed cluster. In: flux (W).
// Out: irradiance, W/m².
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/hvds.glsl"

layout(local_size_x = 64) in;

struct HvdsResolvePush { uint cluster_count; };

layout(scalar, binding = 0) readonly buffer InverseAreas { float inverse_areas[]; };      // 1/m²
layout(scalar, binding = 1) readonly buffer IndirectSources { uint indirect_sources[]; };  // the cluster itself, or one around it
layout(binding = 2) uniform usamplerBuffer ClusterFluxes;
layout(scalar, binding = 3) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(scalar, binding = 4) readonly buffer ReadClusters { uint read_clusters[]; };
layout(scalar, push_constant) uniform Push { HvdsResolvePush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.cluster_count) return;
    uint cluster = read_clusters[index];
    uint source = indirect_sources[cluster];
    irradiance[cluster] = cluster_flux_at(ClusterFluxes, cluster).direct * inverse_areas[cluster]
                        + cluster_flux_at(ClusterFluxes, source).indirect * inverse_areas[source];
}
