// Antialiasing, step 2: lists the edge pixels in tile order, so that those of a workgroup are close
// together. Also sizes the dispatches that follow: workgroups of 64 invocations that find samples,
// and of 64 edge pixels. Deterministic. One invocation = one position in tile order. In: exclusive
// prefix sum of the edge marks, and the total. Out: indices of the edge pixels; for each pixel its
// index in that list; their number (word 3), followed by dispatch sizes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint GROUP_POINTS = 256;  // values of light that a workgroup sums

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

#include "include/edge_groups.glsl"

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
        edge_groups[3] = edge_count;
        put_groups(8u, (edge_count + 63u) / 64u);
        // A view without edges has no fragments, and no workgroup that counts them.
        put_fragments(push.pixel_count, 0u, GROUP_POINTS);
    }
}
