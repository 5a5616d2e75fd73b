// Antialiasing, step 2: lists the edge pixels, in the order of tiles, so that samples of a batch
// lie close together, and counts them and the workgroups that take them: 64 samples each and 64
// pixels each; those that sum light of all pixels and of the edges' slots; and those of 64 batches
// of samples. Deterministic. One invocation = one place of that order. In: edge pixels before each,
// and the end. Out: their indices; the number that each pixel has among them; how many there are
// (word 3) and, behind it, sizes of dispatches.
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
    uint width;
    uint pixel_count;
    EdgeCapacity capacity;
};

layout(scalar, binding = 0) readonly buffer EdgeMarks { uint edge_marks[]; };
layout(scalar, binding = 1) writeonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 2) writeonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 3) writeonly buffer EdgeGroups { uint edge_groups[]; };
layout(scalar, push_constant) uniform Push { EdgeListPush push; };

void put_groups(uint first, uint groups) {
    for (uint axis = 0u; axis < 3u; ++axis) edge_groups[first + axis] = swizzled(groups)[axis];
}

void main() {
    uint place = flat_invocation();
    uvec2 size = uvec2(push.width, push.pixel_count / push.width);
    uvec2 pixel = pixel_in_tiles(place, size.x);
    if (all(lessThan(pixel, size))) {
        uint index = pixel.y * size.x + pixel.x;
        uint number = edge_marks[place];
        bool is_edge = edge_marks[place + 1u] != number;
        if (is_edge) edge_pixels[number] = index;
        edge_numbers[index] = is_edge ? number : NO_EDGE;
    }
    if (place == 0u) {
        uint edge_count = edge_marks[64u * tiles_around(size)];
        edge_numbers[push.pixel_count] = edge_count;
        uint samples = edge_count * samples_per_edge(edge_count, push.capacity);
        edge_groups[3] = edge_count;
        put_groups(4u, (samples + 63u) / 64u);
        put_groups(8u, (edge_count + 63u) / 64u);
        uint points = push.pixel_count + edge_count * slots_per_edge(edge_count, push.capacity);
        put_groups(12u, (points + GROUP_POINTS - 1u) / GROUP_POINTS);
        put_groups(16u, (samples + 64u * BATCH - 1u) / (64u * BATCH));
    }
}
