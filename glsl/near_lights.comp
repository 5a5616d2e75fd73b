// Near-light correction: form factors near a light that is closer to a surface than the spacing of
// entry points. Rays from the light replace the estimate of the entry points. Deterministic. One
// invocation = one entry point. In: corrections. Out: the light's form factors.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct NearFactor {
    uint point;   // index of the entry point
    float kept;   // fraction of its own form factor that stays
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
