// Primary visibility: one ray through each pixel's centre. Deterministic. One invocation = one
// pixel, one workgroup = a tile. In: camera. Out: surfaces at the pixels (metres).
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

struct PrimaryPush { View view; };

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) writeonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, binding = 4) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { PrimaryPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"

void main() {
    View view = push.view;
    uvec2 pixel = corner_of_tile(flat_workgroup(), 8u, view.width) + place_in_tile(8u);
    if (pixel.x >= view.width || pixel.y >= view.height) return;
    pixels[pixel.y * view.width + pixel.x] = seen_through(view, vec2(pixel) + 0.5);
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
