// Form factors: irradiance at each entry point per unit of a light's emission, visibility included.
// [Yue §3] Deterministic. One invocation = one entry point, one workgroup = one batch. In: entry
// points, a light, its shafts. Out: the light's form factors; light_factor gives the units.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"

layout(local_size_x = 64) in;

struct FormFactorsPush {
    uint first_point;   // of the bound buffer of the entry points
    uint point_count;   // in it
    uint light;
    uint first_sample;  // first point sample of this dispatch; later dispatches add to the first
    uint end_sample;
    uint flags;         // TRACES_ALL, ADDS, HAS_SILHOUETTES
    uint first_batch;   // of the bound buffer
    float area_m2;      // of an entry point
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Lights;
layout(binding = 4) uniform usamplerBuffer EntryPoints;
layout(binding = 5) uniform usamplerBuffer ShaftRoots;
layout(scalar, binding = 6) readonly buffer ShaftList { uint shaft_list[]; };
layout(scalar, binding = 7) buffer FormFactors { float form_factors[]; };
layout(binding = 8) uniform usamplerBuffer Silhouettes;
layout(scalar, binding = 9) buffer RayCount { uint ray_count[]; };  // number of rays; initially zero
layout(scalar, binding = 10) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { FormFactorsPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_kind.glsl"
#include "include/direct.glsl"
#include "include/shafts.glsl"
#include "include/shaft_rays.glsl"
#include "include/silhouettes.glsl"
#define IS_LIT is_lit_in
#include "include/sees_alike.glsl"

void main() {
    uint workgroup = flat_workgroup();
    uint batch = batch_of(STARTS_AT == AT_NODES ? workgroup : push.first_batch + workgroup);
    uint index = (batch - push.first_batch) * BATCH + gl_LocalInvocationIndex;
    if (batch == NO_BATCH || batch < push.first_batch) return;
    bool is_point = index < push.point_count;
    uvec4 point = texelFetch(EntryPoints, int(is_point ? index : 0u));  // position; side, 2·triangle + (1 if the back side)
    vec3 position = uintBitsToFloat(point.xyz);
    vec3 normal = facing_normal(point.w);
    uint place = push.first_point + index;
    LightSource light = of_kind(light_at(Lights, push.light));
    float found = 0.0;
    uint seen = 0u;
    if (FINDS_ALIKE != 0u) {
        found = light_factor_in_group(batch, light, push.first_sample, push.end_sample, push.flags, Receiver(position, normal), point.w, normal,
                                      push.area_m2, is_point, seen);
    } else if (is_point) {
        found = light_factor_in(batch, light, push.first_sample, push.end_sample, push.flags, position, normal, normal, push.area_m2, seen);
    }
    if (!is_point) return;
    float before = is_first(push.flags, push.first_sample) ? 0.0 : form_factors[place];
    form_factors[place] = accumulated(light, push.flags, push.end_sample, before, found, position, normal, push.area_m2);
    if (!loops_completed(push.point_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
