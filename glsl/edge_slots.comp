// Antialiasing, step 4: gives each sample of an edge pixel a slot. Samples of one
// material share a slot if they take indirect light from the same pixel, or if no pixel serves
// them and their surfaces are similar. If the slots
// run out, a sample takes the first slot of its material, else the last slot. Deterministic. One
// invocation = one edge pixel. In: its samples. Out: its slots, the slot of each sample, and the
// number of slots that need an edge point.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/records.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ALIKE = 0;  // float bits: dissimilarity up to which samples share a slot

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
layout(scalar, binding = 5) buffer EdgeSamples { EdgeSample edge_samples[]; };
layout(scalar, binding = 6) writeonly buffer EdgeSlots { EdgeSlot edge_slots[]; };
layout(scalar, binding = 7) writeonly buffer PointNumbers { uint point_numbers[]; };  // of each edge pixel; initially zero
layout(scalar, binding = 8) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/edge_points.glsl"
#include "include/alike.glsl"

void main() {
    View view = push.view;
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint slots_each = slots_per_edge(edge_count, push.capacity);
    uint edge = flat_invocation();
    if (edge >= edge_count) return;
    EdgeSlot slots[MAX_SLOTS];
    uint materials[MAX_SLOTS];
    PixelSurface shown[MAX_SLOTS];  // by the first samples of slots apart
    uint used = 0u;
    uint points = 0u;
    for (uint i = 0u; i < MAX_SLOTS; ++i) slots[i] = EdgeSlot(NO_SIDE, 0u, NO_POINT);
    for (uint i = 0u; i < count; ++i) {
        EdgeSample found = edge_samples[edge * count + i];
        if (found.side == NO_SIDE) continue;
        uint material = surface_at(found.side >> 1).material;
        PixelSurface point = PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);
        vec3 facet = vec3(0.0);
        if_any (is_apart(found)) {
            point = edge_point(view, edge_pixels[edge], found, i, count);
            facet = facing_normal(found.side);
        }
        uint own = MAX_SLOTS;
        uint alike = MAX_SLOTS;
        for (uint k = used; k-- > 0u;) {
            if (materials[k] != material) continue;
            alike = k;
            bool is_own = !is_apart(found) && !is_apart(slots[k]) && place_of(slots[k]) == place_of(found);
            if_any (is_apart(found) && is_apart(slots[k])) is_own = dissimilarity(point, facet, shown[k]) <= uintBitsToFloat(ALIKE);
            if (is_own) own = k;
        }
        if (own == MAX_SLOTS && used < slots_each) {
            own = used++;
            slots[own] = EdgeSlot(found.side, place_of(found) | uint(is_apart(found)) << 31, NO_POINT);
            materials[own] = material;
            shown[own] = point;
            points += uint(is_apart(found));
        }
        if (own == MAX_SLOTS) own = alike < MAX_SLOTS ? alike : used - 1u;
        slots[own].what += eighths_of(found) << 4;
        edge_samples[edge * count + i].what = found.what | own << 11;
    }
    for (uint i = 0u; i < slots_each; ++i) edge_slots[edge * slots_each + i] = slots[i];
    point_numbers[edge] = points;
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
