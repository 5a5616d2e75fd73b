// Base level of the volumetric hierarchy: sums the lights' irradiance buffers, weighted by the
// emissions, in the lights' order, one to eight lights a dispatch. A change of colour therefore
// visits no path. Deterministic; a light's index does not change the rounding. One invocation = one
// base cluster. In: per-light irradiance buffers. Out: flux (W).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/hvds.glsl"
#include "include/light_sum.glsl"

layout(local_size_x = 64) in;

layout(binding = 0) uniform usamplerBuffer Row0;
layout(binding = 1) uniform usamplerBuffer Row1;
layout(binding = 2) uniform usamplerBuffer Row2;
layout(binding = 3) uniform usamplerBuffer Row3;
layout(binding = 4) uniform usamplerBuffer Row4;
layout(binding = 5) uniform usamplerBuffer Row5;
layout(binding = 6) uniform usamplerBuffer Row6;
layout(binding = 7) uniform usamplerBuffer Row7;
layout(scalar, binding = 8) buffer LightSums { ClusterFlux light_sums[]; };
layout(scalar, push_constant) uniform Push { LightSumPush push; };

ClusterFlux added(ClusterFlux sum, ClusterLayer layer, vec3 emission) {
    // `precise` forbids fused multiply-add, so that every row rounds alike.
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
    sum = added(sum, cluster_layer_at(Row0, place), push.emission_0);
    if (ROWS > 1u) sum = added(sum, cluster_layer_at(Row1, place), push.emission_1);
    if (ROWS > 2u) {
        sum = added(sum, cluster_layer_at(Row2, place), push.emission_2);
        sum = added(sum, cluster_layer_at(Row3, place), push.emission_3);
    }
    if (ROWS > 4u) {
        sum = added(sum, cluster_layer_at(Row4, place), push.emission_4);
        sum = added(sum, cluster_layer_at(Row5, place), push.emission_5);
        sum = added(sum, cluster_layer_at(Row6, place), push.emission_6);
        sum = added(sum, cluster_layer_at(Row7, place), push.emission_7);
    }
    light_sums[index] = ClusterFlux(push.scale * sum.direct, push.scale * sum.indirect);
}
