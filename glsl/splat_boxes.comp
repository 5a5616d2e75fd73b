// Splatting, before step 1: the box around the visible surfaces of each tile, which excludes
// records in front of them and behind them. Deterministic. One workgroup = one tile. In: pixels.
// Out: boxes, metres; empty for a tile without surface.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/splat.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

struct SplatBoxesPush {
    uvec2 size;  // of the image, pixels
};

layout(binding = 0) uniform usamplerBuffer Pixels;
layout(scalar, binding = 1) writeonly buffer TileBoxes { TileBox tile_boxes[]; };
layout(scalar, push_constant) uniform Push { SplatBoxesPush push; };

shared TileBox boxes[gl_WorkGroupSize.x * gl_WorkGroupSize.y];

void main() {
    uint thread = gl_LocalInvocationIndex;
    uvec2 xy = gl_GlobalInvocationID.xy;
    TileBox box = TileBox(vec3(1e30), vec3(-1e30));
    if (all(lessThan(xy, push.size))) {
        PixelSurface pixel = pixel_surface_at(Pixels, xy.y * push.size.x + xy.x);
        if (pixel.side != NO_SIDE) box = TileBox(pixel.position, pixel.position);
    }
    boxes[thread] = box;
    for (uint stride = gl_WorkGroupSize.x * gl_WorkGroupSize.y / 2u; stride > 0u; stride /= 2u) {
        barrier();
        if (thread < stride) {
            TileBox other = boxes[thread + stride];
            boxes[thread] = TileBox(min(boxes[thread].low, other.low), max(boxes[thread].high, other.high));
        }
    }
    uint columns = (push.size.x + 15u) / 16u;
    if (thread == 0u) tile_boxes[gl_WorkGroupID.y * columns + gl_WorkGroupID.x] = boxes[0];
}
