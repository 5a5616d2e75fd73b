// Bright clusters, step 2: lists the bright ones of the watched clusters, with weights in
// proportion to the direct light that they reflect. Deterministic. One workgroup, which ends at
// once if nothing is bright; each invocation takes a run of clusters. In: sums of step 1, flux of
// clusters (W). Out: list of bright clusters, ranks of watched ones, state.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/hvds.glsl"
#include "include/bright.glsl"

layout(local_size_x = 128) in;

struct BrightSelectPush {
    uint watched_count;
    uint sum_count;      // workgroups of step 1
    float contrast;      // least mean radiant exitance of light, over that of area
    float bright;        // least radiant exitance of a bright cluster, over the mean
};

layout(scalar, binding = 0) readonly buffer WatchedClusters { Watched watched_clusters[]; };
layout(binding = 1) uniform usamplerBuffer Materials;
layout(binding = 2) uniform usamplerBuffer ClusterFluxes;
layout(scalar, binding = 3) readonly buffer InverseAreas { float inverse_areas[]; };  // 1/m²
layout(scalar, binding = 4) readonly buffer BrightSums { BrightSum bright_sums[]; };
layout(scalar, binding = 5) writeonly buffer BrightRanks { uint bright_ranks[]; };  // bright clusters before each watched one, and their number
layout(scalar, binding = 6) writeonly buffer BrightClusters { BrightCluster bright_clusters[]; };
layout(scalar, binding = 7) writeonly buffer BrightStates { BrightState bright_state[]; };  // one
layout(scalar, push_constant) uniform Push { BrightSelectPush push; };

// Least weight of all bright clusters: a thousandth of the light.
const uint MIN_WEIGHT = ALL_LIGHT >> 10;

shared uvec2 counts[128];  // bright clusters of each invocation, and their weight

// Zero: not bright.
uint weight_of(Watched watched, BrightSum all) {
    vec3 flux = cluster_flux_at(ClusterFluxes, watched.cluster).direct;
    float light = brightness(reflectance_at(Materials, watched.material).diffuse * flux);
    bool is_bright = light * inverse_areas[watched.cluster] * all.area > push.bright * all.light;
    // Rounded up, so that each bright cluster has a chance.
    return is_bright ? uint(ceil(min(light / all.light, 1.0) * float(ALL_LIGHT))) : 0u;
}

void main() {
    vec3 sum = vec3(0.0);
    for (uint index = 0u; index < push.sum_count; ++index) {
        BrightSum part = bright_sums[index];
        sum += vec3(part.light, part.area, part.square);
    }
    uint lane = gl_LocalInvocationIndex;
    if (!(sum.z * sum.y > push.contrast * sum.x * sum.x)) {
        if (lane == 0u) bright_state[0] = BrightState(0u, 0u);
        return;
    }
    BrightSum all = BrightSum(sum.x, sum.y, sum.z);
    uint run = (push.watched_count + gl_WorkGroupSize.x - 1u) / gl_WorkGroupSize.x;
    uint first = min(lane * run, push.watched_count), end = min(first + run, push.watched_count);
    uvec2 own = uvec2(0u);
    for (uint index = first; index < end; ++index) {
        uint weight = weight_of(watched_clusters[index], all);
        own += uvec2(weight != 0u ? 1u : 0u, weight);
    }
    counts[lane] = own;
    barrier();
    uvec2 before = uvec2(0u);
    for (uint other = 0u; other < lane; ++other) before += counts[other];
    for (uint index = first; index < end; ++index) {
        Watched watched = watched_clusters[index];
        uint weight = weight_of(watched, all);
        bright_ranks[index] = before.x;
        if (weight == 0u) continue;
        before.y += weight;
        bright_clusters[before.x++] = BrightCluster(watched.cluster, before.y);
    }
    if (lane + 1u < gl_WorkGroupSize.x) return;
    bright_ranks[push.watched_count] = before.x;
    bright_state[0] = before.y >= MIN_WEIGHT ? BrightState(before.x, before.y) : BrightState(0u, 0u);
}
