// Antialiasing, step 5: numbers the edge points, one for each slot that no pixel serves, in the
// middle of its samples. Points beyond the capacity are dropped: their slots take the indirect
// light of a pixel. Deterministic. One invocation = one edge pixel. In: samples, exclusive prefix
// sum of the points of edge pixels. Out: edge points; the point of each slot; dispatch size of
// workgroups of 64 points, and their number.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct EdgeSamplesPush {
    View view;
    EdgeCapacity capacity;
    float smooth_m2;  // see edge_samples
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 4) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 5) uniform usamplerBuffer EdgeSamples;
layout(scalar, binding = 6) readonly buffer PointNumbers { uint point_numbers[]; };
layout(scalar, binding = 7) buffer EdgeSlots { EdgeSlot edge_slots[]; };
layout(scalar, binding = 8) writeonly buffer EdgePoints { PixelSurface edge_points[]; };
layout(scalar, binding = 9) writeonly buffer PointGroups { uint point_groups[]; };  // dispatch size, number of points
layout(scalar, binding = 10) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"

void main() {
    View view = push.view;
    uint pixel_count = view.width * view.height;
    uint edge_count = edge_numbers[pixel_count];
    uint edge = flat_invocation();
    if (edge == 0u) {
        uint points = min(point_numbers[edge_count], push.capacity.points);
        for (uint axis = 0u; axis < 3u; ++axis) point_groups[axis] = swizzled((points + 63u) / 64u)[axis];
        point_groups[3] = points;
    }
    if (edge >= edge_count) return;
    uint count = samples_per_edge(edge_count, push.capacity);
    uint slots_each = slots_per_edge(edge_count, push.capacity);
    uint number = point_numbers[edge];
    uint pixel = edge_pixels[edge];
    vec2 corner = vec2(in_rows(pixel, view.width));
    for (uint i = 0u; i < slots_each; ++i) {
        EdgeSlot slot = edge_slots[edge * slots_each + i];
        bool is_point = slot.side != NO_SIDE && is_apart(slot);
        bool is_kept = is_point && number < push.capacity.points;
        vec2 sum = vec2(0.0);
        float members = 0.0;
        uint end = is_kept ? count : 0u;
        for (uint k = 0u; k < end; ++k) {
            EdgeSample seen = edge_sample_of(pair_at(EdgeSamples, edge * count + k));
            float weight = seen.side != NO_SIDE && slot_of(seen) == i ? 1.0 : 0.0;
            sum += weight * sample_3d(k + point_of(seen) * count, pixel).xy;
            members += weight;
        }
        if (is_kept) {
            edge_points[number] = seen_on(view, corner + sum / members, slot.side);
            edge_slots[edge * slots_each + i].point = number;
        }
        number += uint(is_point);
    }
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
