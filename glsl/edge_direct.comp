// Direct illumination at the samples of edge pixels, by the method of `direct`, times the fraction
// of a sample's image points that met a surface. Deterministic. One invocation = one sample, one
// workgroup = one batch. In: the samples, a light, its shafts. Out: their light; light_factor
// gives the units.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"

#define SAMPLES_OF_PIXEL

layout(local_size_x = 64) in;

struct EdgeLightPush {
    View view;
    EdgeCapacity capacity;
    uint light;
    uint first_sample;  // first sample of an image point in this dispatch; later dispatches add to the first
    uint end_sample;
    uint sample_step;   // of the lattice of the samples of all image points of a pixel
    uint flags;         // TRACES_ALL, ADDS
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Lights;
layout(scalar, binding = 4) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 5) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 6) uniform usamplerBuffer EdgeSamples;
layout(binding = 7) uniform usamplerBuffer ShaftRoots;
layout(scalar, binding = 8) readonly buffer ShaftList { uint shaft_list[]; };
layout(scalar, binding = 9) buffer EdgeLight { float edge_light[]; };
layout(scalar, binding = 10) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeLightPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/edge_points.glsl"
#include "include/lights.glsl"
#include "include/light_kind.glsl"
#include "include/direct.glsl"
#include "include/shafts.glsl"
#include "include/shaft_rays.glsl"

void main() {
    View view = push.view;
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint batch = batch_of(flat_workgroup());
    uint index = batch * BATCH + gl_LocalInvocationIndex;
    if (batch == NO_BATCH || index >= edge_count * count) return;
    uvec2 number = in_rows(index, count);  // of the sample in its pixel, of the pixel
    EdgeSample seen = edge_sample_of(pair_at(EdgeSamples, index));
    LightSource light = seen_from_point(of_kind(light_at(Lights, push.light)), number.x, push.sample_step);
    float found = is_first(push.flags, push.first_sample) ? 0.0 : edge_light[index];
    if_any (seen.side != NO_SIDE) {
        PixelSurface point = edge_point(view, edge_pixels[number.y], seen, number.x, count);
        Receiver at = receiver_of(point);
        uint sees = 0u;
        float lit = light_factor_in(batch, light, push.first_sample, push.end_sample, push.flags, at.position, at.normal, point.normal,
                                    point.footprint, sees);
        lit *= 0.125 * float(eighths_of(seen));
        found = accumulated(light, push.flags, push.end_sample, found, lit, at.position, point.normal, point.footprint);
    }
    edge_light[index] = found;
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
