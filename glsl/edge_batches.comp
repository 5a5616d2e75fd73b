// Batches of edge samples: bounds of the origins of their shadow rays. Deterministic. One
// invocation = one batch. In: surfaces at the samples. Out: batches (metres).
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

layout(local_size_x = 64) in;

struct EdgeSamplesPush {
    View view;
    EdgeCapacity capacity;
    float smooth_m2;  // see edge_samples
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 4) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 5) uniform usamplerBuffer EdgeSamples;

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/edge_points.glsl"
#include "include/shafts.glsl"

layout(scalar, binding = 6) writeonly buffer PointBatches { PointBatch point_batches[]; };
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

void main() {
    View view = push.view;
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint first = flat_invocation() * BATCH;
    if (flat_invocation() >= point_batches.length()) return;
    PointBatch batch = no_points();
    for (uint i = first; i < min(first + BATCH, edge_count * count); ++i) {
        EdgeSample seen = edge_sample_of(pair_at(EdgeSamples, i));
        if (seen.side == NO_SIDE) continue;
        uvec2 number = in_rows(i, count);  // of the sample in its pixel, of the pixel
        PixelSurface point = edge_point(view, edge_pixels[number.y], seen, number.x, count);
        Receiver at = receiver_of(point);
        batch = with_point(batch, at.position, at.normal);
    }
    point_batches[flat_invocation()] = batch;
}
