// Splatting, step 2: one (tile, record) pair for every tile that a record may touch, in record order. Deterministic.
// One invocation = one record. In: pixel rectangles, running pair counts. Out: pairs.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/splat.glsl"

layout(local_size_x = 64) in;

struct SplatEmitPush {
    uint record_count;
    uint tile_columns;
    uint capacity;  // pairs that fit; what does not is seen by the host, which makes room and repeats
};

layout(scalar, binding = 0) readonly buffer Rectangles { PixelRectangle rectangles[]; };
layout(scalar, binding = 1) readonly buffer FirstPairs { uint first_pairs[]; };  // of each record, and the total
layout(scalar, binding = 2) writeonly buffer Pairs { TilePair pairs[]; };
layout(scalar, push_constant) uniform Push { SplatEmitPush push; };

void main() {
    uint record = flat_invocation();
    if (record >= push.record_count) return;
    uint slot = first_pairs[record];
    PixelRectangle rectangle = rectangles[record];
    uvec2 first = uvec2(rectangle.low & 0xffffu, rectangle.low >> 16) / 16u;
    uvec2 end = (uvec2(rectangle.high & 0xffffu, rectangle.high >> 16) + 15u) / 16u;
    for (uint y = first.y; y < end.y; ++y) {
        for (uint x = first.x; x < end.x && slot < push.capacity; ++x) {
            pairs[slot++] = TilePair(y * push.tile_columns + x, record);
        }
    }
}
