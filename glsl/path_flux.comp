// Flux that enters each light path: the lights' form factors weighted by their intensity. [Yue §3] Deterministic.
// One invocation = one path. In: form factors (1/m²), lights (W/sr). Out: flux of the path's first vertex, W.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SHINES = 0;  // 1: some entry points may shine, and what paths carry on is another flux

struct PathFluxPush {
    uint path_count;
    uint light_count;
    float area_m2;  // that each entry point stands for
};

layout(scalar, binding = 0) readonly buffer Lights { LightSource lights[]; };
layout(scalar, binding = 1) readonly buffer FormFactors { float form_factors[]; };
layout(scalar, binding = 2) writeonly buffer PathFlux { vec3 path_flux[]; };
layout(scalar, binding = 3) writeonly buffer ReflectedFlux { vec3 reflected_flux[]; };
layout(scalar, push_constant) uniform Push { PathFluxPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.path_count) return;
    vec3 irradiance = vec3(0.0);
    for (uint i = 0u; i < push.light_count; ++i) {
        irradiance += form_factors[i * push.path_count + index] * lights[i].emission;
    }
    path_flux[index] = push.area_m2 * irradiance;
    if (SHINES == 1u) reflected_flux[index] = push.area_m2 * irradiance;
}
