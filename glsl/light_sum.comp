// Sums lights: irradiance per unit emission, weighted by the emissions, in the lights' order, one
// to eight lights a dispatch. Deterministic; a light's index does not change the rounding. One
// invocation = one value. In: per-light irradiance buffers. Out: sums (RGB).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/light_sum.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = 0) readonly buffer Row0 { float row_0[]; };
layout(scalar, binding = 1) readonly buffer Row1 { float row_1[]; };
layout(scalar, binding = 2) readonly buffer Row2 { float row_2[]; };
layout(scalar, binding = 3) readonly buffer Row3 { float row_3[]; };
layout(scalar, binding = 4) readonly buffer Row4 { float row_4[]; };
layout(scalar, binding = 5) readonly buffer Row5 { float row_5[]; };
layout(scalar, binding = 6) readonly buffer Row6 { float row_6[]; };
layout(scalar, binding = 7) readonly buffer Row7 { float row_7[]; };
layout(scalar, binding = 8) buffer LightSums { vec3 light_sums[]; };
layout(scalar, push_constant) uniform Push { LightSumPush push; };

// `precise` forbids fused multiply-add, so that every row rounds alike.
void add(inout vec3 sum, float value, vec3 emission) {
    precise vec3 added = sum + value * emission;
    sum = added;
}

void main() {
    uint index = flat_invocation();
    if (index >= push.count) return;
    uint place = push.step * index;
    vec3 sum = push.adds != 0u ? light_sums[index] : vec3(0.0);
    add(sum, row_0[place], push.emission_0);
    if (ROWS > 1u) add(sum, row_1[place], push.emission_1);
    if (ROWS > 2u) {
        add(sum, row_2[place], push.emission_2);
        add(sum, row_3[place], push.emission_3);
    }
    if (ROWS > 4u) {
        add(sum, row_4[place], push.emission_4);
        add(sum, row_5[place], push.emission_5);
        add(sum, row_6[place], push.emission_6);
        add(sum, row_7[place], push.emission_7);
    }
    light_sums[index] = push.scale * sum;
}
