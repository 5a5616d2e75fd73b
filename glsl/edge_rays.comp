// Antialiasing, step 6: samples of the edge pixels with too many triangles, by camera rays.
// Deterministic. One invocation = one sample. In: camera, scene, those pixels. Out: the samples,
// without their fragments.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/edge_places.glsl"

layout(local_size_x = 64) in;

struct EdgeSamplesPush {
    View view;
    EdgeCapacity capacity;
    float smooth_m2;  // see fragments
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 4) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 5) readonly buffer DenseEdges { uint dense_edges[]; };
layout(scalar, binding = 6) writeonly buffer EdgeSamples { uint edge_samples[]; };
layout(scalar, binding = 7) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"

void main() {
    View view = push.view;
    uint count = samples_per_edge(edge_numbers[view.width * view.height], push.capacity);
    uvec2 number = in_rows(flat_invocation(), max(count, 1u));  // of the sample in its pixel, of the pixel in the list
    if (count == 0u || number.y >= dense_edges[3]) return;
    uint edge = dense_edges[DENSE_HEADER + number.y];
    uint pixel = edge_pixels[edge];
    vec2 point = vec2(in_rows(pixel, view.width)) + place_in_pixel(number.x, pixel);
    edge_samples[edge * count + number.x] = seen_through(view, point).side;
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
