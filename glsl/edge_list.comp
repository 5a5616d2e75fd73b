// Antialiasing, step 2: lists the edge pixels, in order. One invocation = one pixel. Deterministic.
// In: edge pixels before each pixel, and the end. Out: their indices.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct EdgeListPush { uint pixel_count; };

layout(scalar, binding = 0) readonly buffer EdgeOffsets { uint edge_offsets[]; };
layout(scalar, binding = 1) writeonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, push_constant) uniform Push { EdgeListPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uint place = edge_offsets[index];
    if (edge_offsets[index + 1u] != place) edge_pixels[place] = index;
}
