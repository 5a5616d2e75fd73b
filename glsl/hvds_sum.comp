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

layout(binding = 0) uniform usamplerBuffer Light0;
layout(binding = 1) uniform usamplerBuffer Light1;
layout(binding = 2) uniform usamplerBuffer Light2;
layout(binding = 3) uniform usamplerBuffer Light3;
layout(binding = 4) uniform usamplerBuffer Light4;
layout(binding = 5) uniform usamplerBuffer Light5;
layout(binding = 6) uniform usamplerBuffer Light6;
layout(binding = 7) uniform usamplerBuffer Light7;
layout(scalar, binding = 8) buffer LightSums { ClusterFlux light_sums[]; };
layout(scalar, push_constant) uniform Push { LightSumPush push; };

ClusterFlux added(ClusterFlux sum, LightFlux flux, vec3 emission) {
    // `precise` forbids fused multiply-add, so that every light rounds alike.
    precise vec3 direct = sum.direct + flux.direct * emission;
    precise vec3 indirect = sum.indirect + flux.indirect * emission;
    return ClusterFlux(direct, indirect);
}

void main() {
    uint index = flat_invocation();
    if (index >= push.count) return;
    uint place = push.step * index;
    ClusterFlux sum = ClusterFlux(vec3(0.0), vec3(0.0));
    if (push.adds != 0u) sum = light_sums[index];
    sum = added(sum, light_flux_at(Light0, place), push.emission_0);
    if (LIGHTS > 1u) sum = added(sum, light_flux_at(Light1, place), push.emission_1);
    if (LIGHTS > 2u) {
        sum = added(sum, light_flux_at(Light2, place), push.emission_2);
        sum = added(sum, light_flux_at(Light3, place), push.emission_3);
    }
    if (LIGHTS > 4u) {
        sum = added(sum, light_flux_at(Light4, place), push.emission_4);
        sum = added(sum, light_flux_at(Light5, place), push.emission_5);
        sum = added(sum, light_flux_at(Light6, place), push.emission_6);
        sum = added(sum, light_flux_at(Light7, place), push.emission_7);
    }
    light_sums[index] = ClusterFlux(push.scale * sum.direct, push.scale * sum.indirect);
}
