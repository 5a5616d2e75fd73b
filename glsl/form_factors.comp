// Form factors: irradiance at each entry point from a point light of 1 W/sr, visibility included. [Yue §3]
// Deterministic. One invocation = one entry point. In: entry points. Out: 1/m², free of the light's colour.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"

layout(local_size_x = 64) in;

struct EntryPoint {
    vec3 position;
    uint side;  // 2·triangle + (1 if the back side)
};
struct FormFactorsPush {
    vec3 light_position;
    uint point_count;
    uint first;       // where this light's form factors start
    float area_m2;    // that each entry point stands for
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer EntryPoints { EntryPoint entry_points[]; };
layout(scalar, binding = 4) writeonly buffer FormFactors { float form_factors[]; };
layout(scalar, push_constant) uniform Push { FormFactorsPush push; };

#include "include/bvh.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.point_count) return;
    EntryPoint point = entry_points[index];
    vec3 normal = surfaces[point.side >> 1].normal;
    if ((point.side & 1u) != 0u) normal = -normal;
    vec3 to_light = push.light_position - point.position;
    float cosine = dot(normal, to_light);
    float form_factor = 0.0;
    if (cosine > 0.0 && is_visible(point.position, normal, push.light_position)) {
        // Point to disc of the area that the entry point stands for, instead of 1/d²: finite at any distance. [Wallace]
        float distance2 = dot(to_light, to_light);
        form_factor = cosine * inversesqrt(distance2) / (distance2 + push.area_m2 / PI);
    }
    form_factors[push.first + index] = form_factor;
}
