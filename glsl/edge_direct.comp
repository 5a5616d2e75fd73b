// Direct illumination at the samples of edge pixels, as `direct` has it at pixels, times the share of a sample's points that met a
// surface. Deterministic. One invocation = one sample. In: the samples, a light. Out: their light, see light_factor for units.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct EdgeLightPush {
    View view;
    EdgeRoom room;
    uint light;
    uint first_sample;  // of the light, in this dispatch; later ones add to what the first wrote
    uint end_sample;
    uint traces_all;    // 1: rays are traced although they cannot bring light
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer Lights { LightSource lights[]; };
layout(scalar, binding = 4) readonly buffer EdgeOffsets { uint edge_offsets[]; };
layout(scalar, binding = 5) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 6) readonly buffer EdgeSamples { EdgeSample edge_samples[]; };
layout(scalar, binding = 7) buffer EdgeLight { float edge_light[]; };
layout(scalar, push_constant) uniform Push { EdgeLightPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/primary.glsl"
#include "include/lights.glsl"
#include "include/direct.glsl"

void main() {
    View view = push.view;
    uint edge_count = edge_offsets[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.room);
    uint index = flat_invocation();
    if (index >= edge_count * count) return;
    uint pixel = edge_pixels[index / count];
    EdgeSample seen = edge_samples[index];
    float found = 0.0;
    // A loop that turns once or never: where no sample of a group sees a surface, lavapipe skips it.
    for (bool is_due = seen.side != NO_SIDE; is_due; is_due = false) {
        vec2 corner = vec2(pixel % view.width, pixel / view.width);
        PixelSurface point = seen_on(view, corner + sample_3d(index % count + point_of(seen) * count, pixel).xy, seen.side);
        vec3 normal = surface_at(point.side >> 1).normal;
        if ((point.side & 1u) != 0u) normal = -normal;
        found = light_factor(lights[push.light], push.first_sample, push.end_sample, push.traces_all != 0u, point.position, normal, point.normal,
                             point.footprint);
        found *= 0.125 * float(eighths_of(seen));
    }
    edge_light[index] = (push.first_sample == 0u ? 0.0 : edge_light[index]) + found;
}
