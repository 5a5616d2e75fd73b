// Antialiasing, step 2: lists the edge pixels, in order, and counts them and workgroups that take four each. Deterministic.
// One invocation = one pixel. In: edge pixels before each pixel, and the end. Out: their indices; a dispatch's size.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct EdgeListPush { uint pixel_count; };

layout(scalar, binding = 0) readonly buffer EdgeOffsets { uint edge_offsets[]; };
layout(scalar, binding = 1) writeonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 2) writeonly buffer EdgeGroups { uint edge_groups[]; };
layout(scalar, push_constant) uniform Push { EdgeListPush push; };

// Workgroups along x, fewer than any device takes; the rest goes along y.
const uint ROW = 1024u;

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uint place = edge_offsets[index];
    if (edge_offsets[index + 1u] != place) edge_pixels[place] = index;
    if (index == 0u) {
        uint groups = (edge_offsets[push.pixel_count] + 3u) / 4u;
        edge_groups[0] = min(groups, ROW);
        edge_groups[1] = (groups + ROW - 1u) / ROW;
        edge_groups[2] = 1u;
        edge_groups[3] = edge_offsets[push.pixel_count];
    }
}
