// Antialiasing of a light, step 1: its light at the point of each fragment. Deterministic. One
// invocation = one fragment. In: points, a light. Out: the per-light irradiance buffer at the
// fragments; light_factor gives the units.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct EdgeLightPush {
    View view;
    EdgeCapacity capacity;
    uint light;
    uint first_sample;  // first sample in this dispatch; later dispatches add to the first
    uint end_sample;
    uint sample_step;   // of the lattice of the samples of all image points of a pixel
    uint flags;         // TRACES_ALL, ADDS, MARKS_PENUMBRA
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Lights;
layout(binding = 4) uniform usamplerBuffer FragmentSurfaces;
layout(scalar, binding = 5) readonly buffer EdgeGroups { uint edge_groups[]; };
layout(scalar, binding = 6) buffer LightIrradiance { float light_irradiance[]; };
layout(binding = 7) uniform usamplerBuffer Silhouettes;
layout(scalar, binding = 8) buffer RayCount { uint ray_count[]; };  // number of rays; initially zero
layout(scalar, binding = 9) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeLightPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_kind.glsl"
#include "include/direct.glsl"
#include "include/penumbra.glsl"
#include "include/silhouettes.glsl"
#define IS_LIT(shaft, position, normal, to_light) is_lit(position, normal, to_light)
#include "include/sees_alike.glsl"

void main() {
    uint index = flat_invocation();
    bool is_fragment = index < edge_groups[19];
    uint value = push.view.width * push.view.height + index;
    LightSource light = of_kind(light_at(Lights, push.light));
    PixelSurface point = pixel_surface_at(FragmentSurfaces, is_fragment ? index : 0u);
    Receiver at = receiver_of(point);
    uint seen = 0u;
    float lit = 0.0;
    uint end = end_of_kind(push.first_sample, push.end_sample);
    if (FINDS_ALIKE != 0u) {
        lit = light_factor_in_group(0u, light, push.first_sample, push.end_sample, push.flags, at, flat_side(point), point.normal, point.footprint,
                                    is_fragment, seen);
    } else if (is_fragment) {
        lit = light_factor(light, push.first_sample, end, push.flags, at.position, at.normal, point.normal, point.footprint, seen);
    }
    if (!is_fragment) return;
    float before = is_first(push.flags, push.first_sample) ? 0.0 : light_irradiance[value];
    float found = accumulated(light, push.flags, push.end_sample, abs(before), lit, at.position, point.normal, point.footprint);
    if (LIGHT_KIND == LIGHT_AREA && (push.flags & MARKS_PENUMBRA) != 0u) {
        found = with_mark(found, has_mark(before, seen | seen_before(before, push.flags), push.flags, push.end_sample == light.samples));
    }
    light_irradiance[value] = found;
    if (!loops_completed(push.view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
