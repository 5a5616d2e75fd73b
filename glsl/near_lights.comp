// A light's form factors beside a surface that it is nearer to than entry points are apart: what
// rays from the light found takes the place of what entry points did. Deterministic. One invocation
// = one entry point. In: what becomes of each. Out: the light's row.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct NearFactor {
    uint point;   // which entry point's
    float kept;   // of what it found
    float added;  // 1/m²
};

struct NearLightsPush {
    uint count;  // form factors that change
};

layout(scalar, binding = 0) readonly buffer NearFactors { NearFactor near_factors[]; };
layout(scalar, binding = 1) buffer FormFactors { float form_factors[]; };
layout(scalar, push_constant) uniform Push { NearLightsPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.count) return;
    NearFactor near = near_factors[index];
    form_factors[near.point] = near.kept * form_factors[near.point] + near.added;
}
