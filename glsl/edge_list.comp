// Antialiasing, step 2: lists the edge pixels, in order, and counts them and the workgroups that take them: 64 samples
// each and 64 pixels each; those that sum light of all pixels and of the edges' slots; and those of 64 batches of samples. Deterministic. One invocation = one pixel.
// In: edge pixels before each pixel, and the end. Out: their indices; their number (word 3) and, behind it, sizes of dispatches.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint GROUP_POINTS = 256;  // whose light a workgroup sums
layout(constant_id = 1) const uint BATCH = 64;          // samples that share a shaft

struct EdgeListPush {
    uint pixel_count;
    EdgeRoom room;
};

layout(scalar, binding = 0) readonly buffer EdgeOffsets { uint edge_offsets[]; };
layout(scalar, binding = 1) writeonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 2) writeonly buffer EdgeGroups { uint edge_groups[]; };
layout(scalar, push_constant) uniform Push { EdgeListPush push; };

void put_groups(uint first, uint groups) {
    for (uint axis = 0u; axis < 3u; ++axis) edge_groups[first + axis] = dealt(groups)[axis];
}

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uint place = edge_offsets[index];
    if (edge_offsets[index + 1u] != place) edge_pixels[place] = index;
    if (index == 0u) {
        uint edge_count = edge_offsets[push.pixel_count];
        uint samples = edge_count * samples_per_edge(edge_count, push.room);
        edge_groups[3] = edge_count;
        put_groups(4u, (samples + 63u) / 64u);
        put_groups(8u, (edge_count + 63u) / 64u);
        uint points = push.pixel_count + edge_count * slots_per_edge(edge_count, push.room);
        put_groups(12u, (points + GROUP_POINTS - 1u) / GROUP_POINTS);
        put_groups(16u, (samples + 64u * BATCH - 1u) / (64u * BATCH));
    }
}
