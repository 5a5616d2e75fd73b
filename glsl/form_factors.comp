// Form factors: irradiance at each entry point per unit of a light's emission, visibility included. [Yue §3]
// Deterministic. One invocation = one entry point. In: entry points, a light. Out: its row, see light_factor for units.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"

layout(local_size_x = 64) in;

struct EntryPoint {
    vec3 position;
    uint side;  // 2·triangle + (1 if the back side)
};
struct FormFactorsPush {
    uint first_point;   // of the bound part of the entry points
    uint point_count;   // in it
    uint light;
    uint first_sample;  // of the light, in this dispatch; later ones add to what the first wrote
    uint end_sample;
    uint traces_all;    // 1: rays are traced although they cannot bring light
    float area_m2;      // that each entry point stands for
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer Lights { LightSource lights[]; };
layout(scalar, binding = 4) readonly buffer EntryPoints { EntryPoint entry_points[]; };
layout(scalar, binding = 5) buffer FormFactors { float form_factors[]; };
layout(scalar, push_constant) uniform Push { FormFactorsPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/direct.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.point_count) return;
    EntryPoint point = entry_points[index];
    vec3 normal = surface_at(point.side >> 1).normal;
    if ((point.side & 1u) != 0u) normal = -normal;
    float found = light_factor(lights[push.light], push.first_sample, push.end_sample, push.traces_all != 0u, point.position, normal, normal,
                               push.area_m2);
    uint place = push.first_point + index;
    form_factors[place] = (push.first_sample == 0u ? 0.0 : form_factors[place]) + found;
}
