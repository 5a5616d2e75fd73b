// Antialiasing, step 4: gives each sample of an edge pixel a slot. Samples that take indirect light
// from the same pixel and show the same material share one; those alone share others. If the slots
// run out, a sample takes the first slot of its material, else the last slot. Deterministic. One
// invocation = one edge pixel. In: its samples. Out: its slots, the slot of each sample, and the
// number of its edge points.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct EdgeListPush {
    uint width;
    uint pixel_count;
    EdgeCapacity capacity;
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 1) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 2) buffer EdgeSamples { EdgeSample edge_samples[]; };
layout(scalar, binding = 3) writeonly buffer EdgeSlots { EdgeSlot edge_slots[]; };
layout(scalar, binding = 4) writeonly buffer PointNumbers { uint point_numbers[]; };  // of each edge pixel; initially zero
layout(scalar, push_constant) uniform Push { EdgeListPush push; };

#include "include/surfaces.glsl"

void main() {
    uint edge_count = edge_numbers[push.pixel_count];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint slots_each = slots_per_edge(edge_count, push.capacity);
    uint edge = flat_invocation();
    if (edge >= edge_count) return;
    EdgeSlot slots[MAX_SLOTS];
    uint materials[MAX_SLOTS];
    uint used = 0u;
    for (uint i = 0u; i < MAX_SLOTS; ++i) slots[i] = EdgeSlot(NO_SIDE, 0u, NO_POINT);
    for (uint i = 0u; i < count; ++i) {
        EdgeSample found = edge_samples[edge * count + i];
        if (found.side == NO_SIDE) continue;
        uint material = surface_at(found.side >> 1).material;
        uint own = MAX_SLOTS;
        uint alike = MAX_SLOTS;
        for (uint k = used; k-- > 0u;) {
            if (materials[k] != material) continue;
            alike = k;
            if (place_of(slots[k]) == place_of(found) && (slots[k].point != NO_POINT) == is_alone(found)) own = k;
        }
        if (own == MAX_SLOTS && used < slots_each) {
            own = used++;
            slots[own] = EdgeSlot(found.side, place_of(found), is_alone(found) ? i : NO_POINT);
            materials[own] = material;
        }
        if (own == MAX_SLOTS) own = alike < MAX_SLOTS ? alike : used - 1u;
        slots[own].what += eighths_of(found) << 4;
        edge_samples[edge * count + i].what = found.what | own << 11;
    }
    uint points = 0u;
    for (uint i = 0u; i < slots_each; ++i) {
        edge_slots[edge * slots_each + i] = slots[i];
        points += uint(slots[i].point != NO_POINT);
    }
    point_numbers[edge] = points;
}
