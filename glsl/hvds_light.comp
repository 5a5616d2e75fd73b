// Per-light irradiance buffers of the base level: each cluster sums its contributions of one light,
// or of four, per unit emission. Light straight from the light and light from surfaces have
// separate sums. [Yue §2] A vertex is weighted by its ambient accessibility, except in unweighted
// clusters. If surfaces may be glossy, the outgoing flux after the first bounce is a colour and
// replaces the form factor. Deterministic: the lists have a fixed order, and a light's bits are the
// same alone and among four. One invocation = one listed base cluster. In: contributions, form
// factors, outgoing flux after the first bounce. Out: per-light irradiance buffers.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/hvds.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint LIGHTS = 1;  // 1 or 4; if 1, the buffers of the other lights are arbitrary
layout(constant_id = 1) const uint IS_GLOSSY = 0;  // 0: the form factor is the outgoing flux after the first bounce

struct HvdsLightPush {
    uint first_listed;  // of the base level, in the list
    uint cluster_count;
    uint first_contribution;  // first one of this dispatch; the buffers hold the sum of those before it
    uint end_contribution;    // one past the last of this dispatch
    uint first_bound;    // of the bound buffer of the contributions
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
layout(scalar, binding = 11) buffer LightFlux0 { LightFlux light_flux_0[]; };
layout(scalar, binding = 12) buffer LightFlux1 { LightFlux light_flux_1[]; };
layout(scalar, binding = 13) buffer LightFlux2 { LightFlux light_flux_2[]; };
layout(scalar, binding = 14) buffer LightFlux3 { LightFlux light_flux_3[]; };
layout(scalar, push_constant) uniform Push { HvdsLightPush push; };

// `precise` forbids fused multiply-add, so that one light and four round alike.
void add(inout LightFlux flux, vec3 throughput, vec3 first_bounce) {
    precise vec3 sum = flux.indirect + throughput * first_bounce;
    flux.indirect = sum;
}
void add_direct(inout LightFlux flux, float throughput, float factor) {
    precise float sum = flux.direct + throughput * factor;
    flux.direct = sum;
}

void main() {
    uint index = flat_invocation();
    if (index >= push.cluster_count) return;
    uint cluster = summed_clusters[push.first_listed + index];
    const LightFlux DARK = LightFlux(0.0, vec3(0.0));
    LightFlux sum_0 = DARK, sum_1 = DARK, sum_2 = DARK, sum_3 = DARK;
    ContributionRange range = contribution_range_at(ContributionRanges, cluster);
    bool is_unweighted = range.is_unweighted != 0u;
    if (push.first_contribution > 0u) {
        if (range.end <= push.first_contribution || range.first >= push.end_contribution) return;
        sum_0 = light_flux_0[cluster];
        if (LIGHTS > 1u) {
            sum_1 = light_flux_1[cluster];
            sum_2 = light_flux_2[cluster];
            sum_3 = light_flux_3[cluster];
        }
    }
    uint first = max(range.first, push.first_contribution), end = min(range.first_other, push.end_contribution);
    for (uint i = first; i < end; ++i) {
        Contribution contribution = contribution_at(Contributions, i - push.first_bound);
        // No surface has reflected the path yet: its channels are equal.
        float throughput = contribution_weight(contribution, is_unweighted) * contribution.throughput.x;
        uint path = path_of(contribution);
        add_direct(sum_0, throughput, number_at(Factors0, path));
        if (LIGHTS == 1u) continue;
        add_direct(sum_1, throughput, number_at(Factors1, path));
        add_direct(sum_2, throughput, number_at(Factors2, path));
        add_direct(sum_3, throughput, number_at(Factors3, path));
    }
    first = max(range.first_other, push.first_contribution);
    end = min(range.end, push.end_contribution);
    for (uint i = first; i < end; ++i) {
        Contribution contribution = contribution_at(Contributions, i - push.first_bound);
        vec3 throughput = contribution_weight(contribution, is_unweighted) * contribution.throughput;
        uint path = path_of(contribution);
        add(sum_0, throughput, IS_GLOSSY != 0u ? first_bounce_0[path] : vec3(number_at(Factors0, path)));
        if (LIGHTS == 1u) continue;
        add(sum_1, throughput, IS_GLOSSY != 0u ? first_bounce_1[path] : vec3(number_at(Factors1, path)));
        add(sum_2, throughput, IS_GLOSSY != 0u ? first_bounce_2[path] : vec3(number_at(Factors2, path)));
        add(sum_3, throughput, IS_GLOSSY != 0u ? first_bounce_3[path] : vec3(number_at(Factors3, path)));
    }
    light_flux_0[cluster] = sum_0;
    if (LIGHTS == 1u) return;
    light_flux_1[cluster] = sum_1;
    light_flux_2[cluster] = sum_2;
    light_flux_3[cluster] = sum_3;
}
