// Base level of the volumetric hierarchy: sums what clusters receive of each light per unit of its emission, weighted by the
// emissions, in the lights' order, one to eight to a dispatch: a change of colour visits no path. Deterministic, and the same bits
// whichever place a light has. One invocation = one base cluster. In: layers. Out: flux (W).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/hvds.glsl"
#include "include/light_sum.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = 0) readonly buffer Row0 { ClusterLayer row_0[]; };
layout(scalar, binding = 1) readonly buffer Row1 { ClusterLayer row_1[]; };
layout(scalar, binding = 2) readonly buffer Row2 { ClusterLayer row_2[]; };
layout(scalar, binding = 3) readonly buffer Row3 { ClusterLayer row_3[]; };
layout(scalar, binding = 4) readonly buffer Row4 { ClusterLayer row_4[]; };
layout(scalar, binding = 5) readonly buffer Row5 { ClusterLayer row_5[]; };
layout(scalar, binding = 6) readonly buffer Row6 { ClusterLayer row_6[]; };
layout(scalar, binding = 7) readonly buffer Row7 { ClusterLayer row_7[]; };
layout(scalar, binding = 8) buffer LightSums { ClusterFlux light_sums[]; };
layout(scalar, push_constant) uniform Push { LightSumPush push; };

ClusterFlux added(ClusterFlux sum, ClusterLayer layer, vec3 emission) {
    // `precise` keeps products and sums apart: every place rounds alike.
    precise vec3 direct = sum.direct + layer.direct * emission;
    precise vec3 indirect = sum.indirect + layer.indirect * emission;
    return ClusterFlux(direct, indirect);
}

void main() {
    uint index = flat_invocation();
    if (index >= push.count) return;
    uint place = push.step * index;
    ClusterFlux sum = ClusterFlux(vec3(0.0), vec3(0.0));
    if (push.adds != 0u) sum = light_sums[index];
    sum = added(sum, row_0[place], push.emission_0);
    if (ROWS > 1u) sum = added(sum, row_1[place], push.emission_1);
    if (ROWS > 2u) {
        sum = added(sum, row_2[place], push.emission_2);
        sum = added(sum, row_3[place], push.emission_3);
    }
    if (ROWS > 4u) {
        sum = added(sum, row_4[place], push.emission_4);
        sum = added(sum, row_5[place], push.emission_5);
        sum = added(sum, row_6[place], push.emission_6);
        sum = added(sum, row_7[place], push.emission_7);
    }
    light_sums[index] = ClusterFlux(push.scale * sum.direct, push.scale * sum.indirect);
}
