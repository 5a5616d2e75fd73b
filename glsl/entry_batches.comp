// Batches of entry points: bounds of the origins of their shadow rays. Deterministic. One
// invocation = one batch. In: entry points. Out: batches (metres).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct EntryPoint {
    vec3 position;
    uint side;  // 2·triangle + (1 if the back side)
};
struct EntryBatchesPush {
    uint first_batch;  // of the bound buffer of the entry points
    uint point_count;  // in it
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer EntryPoints { EntryPoint entry_points[]; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/shafts.glsl"

layout(scalar, binding = 4) writeonly buffer PointBatches { PointBatch point_batches[]; };
layout(scalar, push_constant) uniform Push { EntryBatchesPush push; };

void main() {
    uint index = flat_invocation();
    uint first = index * BATCH;
    if (first >= push.point_count) return;
    PointBatch batch = no_points();
    for (uint i = first; i < min(first + BATCH, push.point_count); ++i) {
        EntryPoint point = entry_points[i];
        batch = with_point(batch, point.position, facing_normal(point.side));
    }
    point_batches[push.first_batch + index] = batch;
}
