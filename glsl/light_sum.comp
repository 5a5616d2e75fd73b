// Sums lights: irradiance per unit emission, weighted by the emissions, in the lights' order, one
// to eight lights a dispatch. Deterministic; a light's index does not change the rounding. One
// invocation = one value. In: per-light irradiance buffers. Out: sums (RGB).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/light_sum.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = 0) readonly buffer Light0 { float light_0[]; };
layout(scalar, binding = 1) readonly buffer Light1 { float light_1[]; };
layout(scalar, binding = 2) readonly buffer Light2 { float light_2[]; };
layout(scalar, binding = 3) readonly buffer Light3 { float light_3[]; };
layout(scalar, binding = 4) readonly buffer Light4 { float light_4[]; };
layout(scalar, binding = 5) readonly buffer Light5 { float light_5[]; };
layout(scalar, binding = 6) readonly buffer Light6 { float light_6[]; };
layout(scalar, binding = 7) readonly buffer Light7 { float light_7[]; };
layout(scalar, binding = 8) buffer LightSums { vec3 light_sums[]; };
layout(scalar, push_constant) uniform Push { LightSumPush push; };

// `precise` forbids fused multiply-add, so that every light rounds alike.
void add(inout vec3 sum, float value, vec3 emission) {
    precise vec3 added = sum + value * emission;
    sum = added;
}

void main() {
    uint index = flat_invocation();
    if (index >= push.count) return;
    uint place = push.step * index;
    vec3 sum = push.adds != 0u ? light_sums[index] : vec3(0.0);
    add(sum, light_0[place], push.emission_0);
    if (LIGHTS > 1u) add(sum, light_1[place], push.emission_1);
    if (LIGHTS > 2u) {
        add(sum, light_2[place], push.emission_2);
        add(sum, light_3[place], push.emission_3);
    }
    if (LIGHTS > 4u) {
        add(sum, light_4[place], push.emission_4);
        add(sum, light_5[place], push.emission_5);
        add(sum, light_6[place], push.emission_6);
        add(sum, light_7[place], push.emission_7);
    }
    light_sums[index] = push.scale * sum;
}
