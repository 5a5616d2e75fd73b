// Antialiasing, step 9: links each fragment with those of the pixels around that show the same
// surface, and numbers the edge points, one for each fragment that needs indirect light of its own.
// Fragments beyond the capacity of points take the indirect light of a pixel. Deterministic. One
// invocation = one fragment. In: fragments, exclusive prefix sum of the edge points. Out: links and
// points of the fragments; edge points; dispatch size of workgroups of 64, and their number.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/antialias.glsl"
#include "include/records.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ALIKE = 0;  // float bits: dissimilarity up to which fragments show one surface

struct EdgeListPush {
    uint width;
    uint pixel_count;
    EdgeCapacity capacity;
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 1) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 2) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 3) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(scalar, binding = 4) buffer Fragments { Fragment fragments[]; };
layout(binding = 5) uniform usamplerBuffer FragmentSurfaces;
layout(scalar, binding = 6) readonly buffer PointNumbers { uint point_numbers[]; };
layout(scalar, binding = 7) readonly buffer EdgeGroups { uint edge_groups[]; };
layout(scalar, binding = 8) writeonly buffer EdgePoints { PixelSurface edge_points[]; };
layout(scalar, binding = 9) writeonly buffer PointGroups { uint point_groups[]; };  // dispatch size, number of points
layout(scalar, push_constant) uniform Push { EdgeListPush push; };

#include "include/surfaces.glsl"
#include "include/alike.glsl"

void main() {
    uint index = flat_invocation();
    uint total = edge_groups[19];
    if (index == 0u) {
        uint points = min(point_numbers[total], push.capacity.points);
        for (uint axis = 0u; axis < 3u; ++axis) point_groups[axis] = swizzled((points + 63u) / 64u)[axis];
        point_groups[3] = points;
    }
    if (index >= total) return;
    Fragment own = fragments[index];
    PixelSurface shown = pixel_surface_at(FragmentSurfaces, index);
    vec3 facet = facing_normal(shown.side);
    uint pixel = edge_pixels[own.edge];
    uvec2 size = uvec2(push.width, push.pixel_count / push.width);
    uint links = 0u;
    for (uint n = 0u; n < 8u; ++n) {
        uint edge = edge_numbers[pixel_at(size, pixel, n + uint(n >= 4u))];
        if (edge == NO_EDGE || edge == own.edge) continue;
        uint first = fragment_firsts[edge];
        for (uint k = 0u; k < fragment_firsts[edge + 1u] - first; ++k) {
            PixelSurface other = pixel_surface_at(FragmentSurfaces, first + k);
            if (dissimilarity(shown, facet, other) <= uintBitsToFloat(ALIKE)) links |= 1u << (4u * n + k);
        }
    }
    fragments[index].neighbours = links;
    uint number = point_numbers[index];
    if (is_apart(own) && number < push.capacity.points) {
        edge_points[number] = PixelSurface(shown.position, shown.side, normalize(shown.normal), shown.footprint);
        fragments[index].point = number;
    }
}
