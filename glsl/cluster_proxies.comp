// Directional proxies: a coarse cluster that is partly hidden from a direction gets the weighted
// mean of its visible finer clusters there. [Yue §2, Figure 1] Deterministic. One invocation = one
// proxy. In: irradiance of clusters, W/m². Out: irradiance of proxies, W/m², behind the clusters
// in the same buffer.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct ClusterProxiesPush {
    uint cluster_count;
    uint proxy_count;
    uint weight_bits;  // width of the weight field in an entry of `proxy_terms`
};

layout(scalar, binding = 0) readonly buffer TermOffsets { uint term_offsets[]; };  // CSR offsets: one for each proxy, and the end
layout(scalar, binding = 1) readonly buffer ProxyTerms { uint proxy_terms[]; };  // cluster << weight_bits | (steps - 1)
layout(scalar, binding = 2) buffer Irradiance { vec3 irradiance[]; };
layout(scalar, push_constant) uniform Push { ClusterProxiesPush push; };

void main() {
    uint proxy = flat_invocation();
    if (proxy >= push.proxy_count) return;
    uint steps = 1u << push.weight_bits;  // sum of the weights of a proxy, in steps
    vec3 sum = vec3(0.0);
    for (uint i = term_offsets[proxy]; i < term_offsets[proxy + 1u]; ++i) {
        uint term = proxy_terms[i];
        sum += float((term & (steps - 1u)) + 1u) * irradiance[term >> push.weight_bits];
    }
    irradiance[push.cluster_count + proxy] = sum / float(steps);
}
