// Views of clusters: what a coarse cluster shows in directions from which part of it is hidden is the weighted mean of the
// clusters below it that can be seen. [Yue §2, Figure 1] Deterministic. One invocation = one view.
// In: irradiance of clusters, W/m². Out: irradiance of views, behind them in the same buffer.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct ClusterViewsPush {
    uint cluster_count;
    uint view_count;
    uint weight_bits;  // of a part
};

layout(scalar, binding = 0) readonly buffer PartOffsets { uint part_offsets[]; };  // of each view, and the end
layout(scalar, binding = 1) readonly buffer ViewParts { uint view_parts[]; };  // cluster << weight_bits | (steps - 1)
layout(scalar, binding = 2) buffer Irradiance { vec3 irradiance[]; };
layout(scalar, push_constant) uniform Push { ClusterViewsPush push; };

void main() {
    uint view = flat_invocation();
    if (view >= push.view_count) return;
    uint steps = 1u << push.weight_bits;  // of all parts together
    vec3 sum = vec3(0.0);
    for (uint i = part_offsets[view]; i < part_offsets[view + 1u]; ++i) {
        uint part = view_parts[i];
        sum += float((part & (steps - 1u)) + 1u) * irradiance[part >> push.weight_bits];
    }
    irradiance[push.cluster_count + view] = sum / float(steps);
}
