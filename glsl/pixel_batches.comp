// Batches of pixels, a tile of 8×8 each: bounds of the origins of their shadow rays.
// Deterministic. One invocation = one batch. In: surfaces at the pixels. Out: batches (metres).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"

layout(local_size_x = 64) in;

struct PixelBatchesPush {
    uint width;        // points of a row
    uint point_count;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer SeenPoints { PixelSurface seen_points[]; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/shafts.glsl"

layout(scalar, binding = 4) writeonly buffer PointBatches { PointBatch point_batches[]; };
layout(scalar, push_constant) uniform Push { PixelBatchesPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= point_batches.length()) return;
    uvec2 corner = corner_of_tile(index, 8u, push.width);
    PointBatch batch = no_points();
    for (uint i = 0u; i < BATCH; ++i) {
        uvec2 xy = corner + uvec2(i % 8u, i / 8u);
        uint place = xy.y * push.width + xy.x;
        if (xy.x >= push.width || place >= push.point_count) continue;
        PixelSurface point = seen_points[place];
        if (point.side == NO_SIDE) continue;
        Receiver at = receiver_of(point);
        batch = with_point(batch, at.position, at.normal);
    }
    point_batches[index] = batch;
}
