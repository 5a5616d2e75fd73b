// Sums lights: rows of what each light sends per unit of its emission, weighted by the emissions, in the lights' order, four
// or eight to a dispatch. Deterministic, and the same bits whichever place a light has. One invocation = one value of a row.
// In: rows. Out: sums, a colour each.
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

void main() {
    uint index = flat_invocation();
    if (index >= push.count) return;
    uint place = push.step * index;
    precise vec3 sum = push.adds != 0u ? light_sums[index] : vec3(0.0);
    // `precise` keeps products and sums apart: every place rounds alike.
    precise vec3 sum_0 = sum + row_0[place] * push.emission_0;
    precise vec3 sum_1 = sum_0 + row_1[place] * push.emission_1;
    precise vec3 sum_2 = sum_1 + row_2[place] * push.emission_2;
    precise vec3 sum_3 = sum_2 + row_3[place] * push.emission_3;
    if (ROWS == 4u) {
        light_sums[index] = push.scale * sum_3;
        return;
    }
    precise vec3 sum_4 = sum_3 + row_4[place] * push.emission_4;
    precise vec3 sum_5 = sum_4 + row_5[place] * push.emission_5;
    precise vec3 sum_6 = sum_5 + row_6[place] * push.emission_6;
    precise vec3 sum_7 = sum_6 + row_7[place] * push.emission_7;
    light_sums[index] = push.scale * sum_7;
}
