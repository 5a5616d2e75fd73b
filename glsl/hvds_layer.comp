// Layers of the base level of the volumetric hierarchy: each cluster adds up what the light paths
// contribution in it of one light, or of four, per unit of the light's emission: light that comes
// straight from the light apart from light that comes from surfaces. [Yue §2] Vertices count as
// they show to readers from afar, but not in unweighted clusters. Where surfaces may be glossy,
// what a path carries on from its entry point is not the form factor there, but a colour.
// Deterministic: the lists have a fixed order, and a light's bits are the same alone and among
// four. One invocation = one listed base cluster. In: contributions, form factors, what paths carry
// on. Out: layers.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/hvds.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint LIGHTS = 1;  // 1 or 4; where it is 1, the other lights' buffers are any
layout(constant_id = 1) const uint IS_GLOSSY = 0;  // 0: paths carry on their factors

struct HvdsLayerPush {
    uint first_place;  // of the base level, in the list
    uint cluster_count;
    uint first_contribution;  // that is added; layers hold what those before it brought
    uint end_contribution;    // end of those that are
    uint first_bound;    // of the bound part of the contributions
};

layout(binding = 0) uniform usamplerBuffer Factors0;
layout(binding = 1) uniform usamplerBuffer Factors1;
layout(binding = 2) uniform usamplerBuffer Factors2;
layout(binding = 3) uniform usamplerBuffer Factors3;
layout(scalar, binding = 4) readonly buffer FirstBounce0 { vec3 first_bounce_0[]; };
layout(scalar, binding = 5) readonly buffer FirstBounce1 { vec3 first_bounce_1[]; };
layout(scalar, binding = 6) readonly buffer FirstBounce2 { vec3 first_bounce_2[]; };
layout(scalar, binding = 7) readonly buffer FirstBounce3 { vec3 first_bounce_3[]; };
layout(binding = 8) uniform usamplerBuffer ContributionRanges;  // of each base cluster
layout(binding = 9) uniform usamplerBuffer Contributions;
layout(scalar, binding = 10) readonly buffer SummedClusters { uint summed_clusters[]; };
layout(scalar, binding = 11) buffer Layer0 { ClusterLayer layer_0[]; };
layout(scalar, binding = 12) buffer Layer1 { ClusterLayer layer_1[]; };
layout(scalar, binding = 13) buffer Layer2 { ClusterLayer layer_2[]; };
layout(scalar, binding = 14) buffer Layer3 { ClusterLayer layer_3[]; };
layout(scalar, push_constant) uniform Push { HvdsLayerPush push; };

// `precise` keeps products and sums apart: one light and four round alike.
void add(inout ClusterLayer layer, vec3 throughput, vec3 first_bounce) {
    precise vec3 sum = layer.indirect + throughput * first_bounce;
    layer.indirect = sum;
}
void add_direct(inout ClusterLayer layer, float throughput, float factor) {
    precise float sum = layer.direct + throughput * factor;
    layer.direct = sum;
}

void main() {
    uint index = flat_invocation();
    if (index >= push.cluster_count) return;
    uint cluster = summed_clusters[push.first_place + index];
    const ClusterLayer DARK = ClusterLayer(0.0, vec3(0.0));
    ClusterLayer sum_0 = DARK, sum_1 = DARK, sum_2 = DARK, sum_3 = DARK;
    ContributionRange run = contribution_range_at(ContributionRanges, cluster);
    bool is_unweighted = run.is_unweighted != 0u;
    if (push.first_contribution > 0u) {
        if (run.end <= push.first_contribution || run.first >= push.end_contribution) return;
        sum_0 = layer_0[cluster];
        if (LIGHTS > 1u) {
            sum_1 = layer_1[cluster];
            sum_2 = layer_2[cluster];
            sum_3 = layer_3[cluster];
        }
    }
    uint first = max(run.first, push.first_contribution), end = min(run.first_other, push.end_contribution);
    for (uint i = first; i < end; ++i) {
        Contribution contribution = contribution_at(Contributions, i - push.first_bound);
        // Nothing has reflected the path yet: its channels are alike.
        float throughput = share_of(contribution, is_unweighted) * contribution.throughput.x;
        uint path = path_of(contribution);
        add_direct(sum_0, throughput, number_at(Factors0, path));
        if (LIGHTS == 1u) continue;
        add_direct(sum_1, throughput, number_at(Factors1, path));
        add_direct(sum_2, throughput, number_at(Factors2, path));
        add_direct(sum_3, throughput, number_at(Factors3, path));
    }
    first = max(run.first_other, push.first_contribution);
    end = min(run.end, push.end_contribution);
    for (uint i = first; i < end; ++i) {
        Contribution contribution = contribution_at(Contributions, i - push.first_bound);
        vec3 throughput = share_of(contribution, is_unweighted) * contribution.throughput;
        uint path = path_of(contribution);
        add(sum_0, throughput, IS_GLOSSY != 0u ? first_bounce_0[path] : vec3(number_at(Factors0, path)));
        if (LIGHTS == 1u) continue;
        add(sum_1, throughput, IS_GLOSSY != 0u ? first_bounce_1[path] : vec3(number_at(Factors1, path)));
        add(sum_2, throughput, IS_GLOSSY != 0u ? first_bounce_2[path] : vec3(number_at(Factors2, path)));
        add(sum_3, throughput, IS_GLOSSY != 0u ? first_bounce_3[path] : vec3(number_at(Factors3, path)));
    }
    layer_0[cluster] = sum_0;
    if (LIGHTS == 1u) return;
    layer_1[cluster] = sum_1;
    layer_2[cluster] = sum_2;
    layer_3[cluster] = sum_3;
}
