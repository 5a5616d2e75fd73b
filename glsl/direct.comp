// Direct illumination: irradiance at surface points per unit of a light's emission. [Yue §4, Tdi]
// Deterministic. One invocation = one point, one workgroup = one batch. In: points that camera rays
// met, a light, its shafts. Out: the per-light irradiance buffer; light_factor gives the units.
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

struct DirectPush {
    uint width;         // points of a row
    uint point_count;
    uint light;
    uint first_sample;  // first point sample of this dispatch; later dispatches add to the first
    uint end_sample;
    uint flags;         // TRACES_ALL, ADDS, HAS_SILHOUETTES
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Lights;
layout(binding = 4) uniform usamplerBuffer SeenPoints;
layout(binding = 5) uniform usamplerBuffer ShaftRoots;
layout(scalar, binding = 6) readonly buffer ShaftList { uint shaft_list[]; };
layout(scalar, binding = 7) buffer LightIrradiance { float light_irradiance[]; };
layout(binding = 8) uniform usamplerBuffer Silhouettes;
layout(scalar, binding = 9) buffer RayCount { uint ray_count[]; };  // number of rays; initially zero
layout(scalar, binding = 10) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { DirectPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_kind.glsl"
#include "include/direct.glsl"
#include "include/shafts.glsl"
#include "include/shaft_rays.glsl"
#include "include/penumbra.glsl"
#include "include/silhouettes.glsl"
#define IS_LIT is_lit_in
#include "include/sees_alike.glsl"

// Distance of the outer probes from the light's edges, in units of the edges: a lamp may sit in a
// frame.
const float INSET = 0.02;

// What a point sees of an area light at the points of a grid, as in light_factor_in. A straight
// edge that hides a part of the light hides a corner.
uint seen_by_probes(uint shaft, LightSource light, Receiver at, vec3 shading, float area) {
    uint seen = 0u;
    for (uint i = 0u; i < 16u; ++i) {
        LightSample found;
        float factor = open_factor(light, mix(vec2(INSET), vec2(1.0 - INSET), vec2(i & 3u, i >> 2) / 3.0), at.position, at.normal, shading, area, found);
        if_any (factor > 0.0) seen |= is_lit_in(shaft, at.position, at.normal, found) ? SEES_LIT : SEES_HIDDEN;
    }
    return seen;
}

// The light with the sign that marks a penumbra, as shadow_mark and fragment_mark read it.
float marked(uint shaft, LightSource light, Receiver at, PixelSurface point, float before, float found, uint seen) {
    seen |= seen_before(before, push.flags);
    bool is_last = push.end_sample == light.samples;
    bool has_roots = word_at(ShaftRoots, shaft * SHAFT_WORDS) != 0u;
    if_any (is_last && has_roots && seen != (SEES_LIT | SEES_HIDDEN)) seen |= seen_by_probes(shaft, light, at, point.normal, point.footprint);
    return with_mark(found, has_mark(before, seen, push.flags, is_last));
}

void main() {
    uint batch = batch_of(flat_workgroup());
    if (batch == NO_BATCH) return;
    uvec2 xy = corner_of_tile(batch, 8u, push.width) + place_in_tile(8u);
    uint index = xy.y * push.width + xy.x;
    bool is_inside = xy.x < push.width && index < push.point_count;
    LightSource light = of_kind(light_at(Lights, push.light));
    PixelSurface point = pixel_surface_at(SeenPoints, is_inside ? index : 0u);
    bool is_point = is_inside && point.side != NO_SIDE;
    Receiver at = Receiver(point.position, point.normal);
    if_any (is_point) at = receiver_of(point);
    uint seen = 0u;
    float lit = 0.0;
    if (FINDS_ALIKE != 0u) {
        lit = light_factor_in_group(batch, light, push.first_sample, push.end_sample, push.flags, at, flat_side(point), point.normal,
                                    point.footprint, is_point, seen);
    } else {
        if_any (is_point) {
            lit = light_factor_in(batch, light, push.first_sample, push.end_sample, push.flags, at.position, at.normal, point.normal,
                                  point.footprint, seen);
        }
    }
    if (!is_inside) return;
    float before = is_first(push.flags, push.first_sample) ? 0.0 : light_irradiance[index];
    float found = abs(before);
    if_any (is_point) {
        found = accumulated(light, push.flags, push.end_sample, found, lit, at.position, point.normal, point.footprint);
        if (LIGHT_KIND == LIGHT_AREA && (push.flags & MARKS_PENUMBRA) != 0u) found = marked(batch, light, at, point, before, found, seen);
    }
    light_irradiance[index] = found;
    if (!loops_completed(push.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
