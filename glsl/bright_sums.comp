// Bright clusters, step 1: sums over the watched clusters. Deterministic. One workgroup = every
// n-th group of 64 clusters. In: flux of clusters (W), reflectances. Out: its sums.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/hvds.glsl"
#include "include/bright.glsl"

layout(local_size_x = 64) in;

struct BrightSumsPush {
    uint watched_count;
    uint stride;         // invocations of all workgroups
};

layout(scalar, binding = 0) readonly buffer WatchedClusters { Watched watched_clusters[]; };
layout(binding = 1) uniform usamplerBuffer Materials;
layout(binding = 2) uniform usamplerBuffer ClusterFluxes;
layout(scalar, binding = 3) readonly buffer InverseAreas { float inverse_areas[]; };  // 1/m²
layout(scalar, binding = 4) writeonly buffer BrightSums { BrightSum bright_sums[]; };
layout(scalar, push_constant) uniform Push { BrightSumsPush push; };

shared vec3 parts[64];

void main() {
    vec3 sum = vec3(0.0);
    for (uint index = flat_invocation(); index < push.watched_count; index += push.stride) {
        Watched watched = watched_clusters[index];
        float inverse_area = inverse_areas[watched.cluster];
        vec3 flux = cluster_flux_at(ClusterFluxes, watched.cluster).direct;
        float light = brightness(reflectance_at(Materials, watched.material).diffuse * flux);
        if (inverse_area > 0.0) sum += vec3(light, 1.0 / inverse_area, light * light * inverse_area);
    }
    parts[gl_LocalInvocationIndex] = sum;
    barrier();
    if (gl_LocalInvocationIndex != 0u) return;
    for (uint lane = 1u; lane < 64u; ++lane) sum += parts[lane];
    bright_sums[flat_workgroup()] = BrightSum(sum.x, sum.y, sum.z);
}
