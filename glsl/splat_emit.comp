// Splatting, step 2: one (tile, record) pair for every tile that a record may touch, in record
// order. Deterministic. One invocation = one record. In: pixel rectangles, tiles' boxes, running
// pair counts. Out: pairs.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/splat.glsl"

layout(local_size_x = 64) in;

struct SplatEmitPush {
    uint record_count;
    uint tile_columns;
    uint capacity;  // of the list of pairs; the host detects an overflow, enlarges the list and repeats
};

layout(scalar, binding = 0) readonly buffer Rectangles { PixelRectangle rectangles[]; };
layout(scalar, binding = 1) readonly buffer PairOffsets { uint pair_offsets[]; };  // exclusive prefix sum over the records, and the total
layout(scalar, binding = 2) writeonly buffer Pairs { TilePair pairs[]; };
layout(binding = 3) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 4) readonly buffer TileBoxes { TileBox tile_boxes[]; };
layout(scalar, push_constant) uniform Push { SplatEmitPush push; };

void main() {
    uint record = flat_invocation();
    if (record >= push.record_count) return;
    uint slot = pair_offsets[record];
    uvec4 tiles = tiles_of(rectangles[record]);
    CachePoint point = cache_point_at(CachePoints, record);
    for (uint y = tiles.y; y < tiles.w; ++y) {
        for (uint x = tiles.x; x < tiles.z && slot < push.capacity; ++x) {
            uint tile = y * push.tile_columns + x;
            if (!reaches(point.position, point.radius, tile_boxes[tile])) continue;
            pairs[slot++] = TilePair(tile, record);
        }
    }
}
