// Antialiasing, step 7: groups the samples of an edge pixel into fragments. A sample joins the
// fragment whose first sample it resembles most, if the material is the same and no edge is
// between both; else it begins a fragment. Samples on one side of a triangle stay together. If the
// fragments run out, a sample joins the most similar one. Deterministic. One invocation = one edge
// pixel. In: surfaces at the samples. Out: the fragment of each sample; the number of fragments.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/edge_places.glsl"
#include "include/records.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ALIKE = 0;  // float bits: dissimilarity up to which samples see one surface

struct EdgeSamplesPush {
    View view;
    EdgeCapacity capacity;
    float smooth_m2;  // see fragments
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 4) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 5) uniform usamplerBuffer EdgeSamples;
layout(scalar, binding = 6) writeonly buffer SampleFragments { uint sample_fragments[]; };
layout(scalar, binding = 7) writeonly buffer FragmentFirsts { uint fragment_firsts[]; };  // of each edge pixel; initially zero
layout(scalar, binding = 8) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/alike.glsl"

const uint KNOWN = 8u;  // sides whose fragment is kept in mind

void main() {
    View view = push.view;
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint most = fragments_per_edge(edge_count, push.capacity);
    uint edge = flat_invocation();
    if (edge >= edge_count) return;
    uint pixel = edge_pixels[edge];
    vec2 corner = vec2(in_rows(pixel, view.width));
    PixelSurface shown[MAX_FRAGMENTS];  // by the first sample
    uint materials[MAX_FRAGMENTS];
    uint used = 0u;
    uint known_sides[KNOWN];
    uint known_fragments = 0u;  // half a byte each
    uint compared = 0u;         // sides so far
    for (uint k = 0u; k < KNOWN; ++k) known_sides[k] = NO_SIDE;
    uint i = 0u;
    uint word = 0u;  // fragments of eight samples
    while (i < count) {
        // Moves on to the next sample with an unknown side. The invocations beside this one do so,
        // too, so that the comparison below is not made at every sample that needs one anywhere.
        uint side = NO_SIDE;
        for (bool is_known = true; is_known && i < count;) {
            side = word_at(EdgeSamples, edge * count + i);
            uint own = side == NO_SIDE ? NO_FRAGMENT : MAX_FRAGMENTS;
            for (uint k = 0u; k < KNOWN; ++k) own = known_sides[k] == side && side != NO_SIDE ? known_fragments >> 4u * k & 15u : own;
            is_known = own != MAX_FRAGMENTS;
            if (!is_known) continue;
            word |= own << 4u * (i & 7u);
            ++i;
            if ((i & 7u) != 0u) continue;
            sample_fragments[(edge * count + i) / 8u - 1u] = word;
            word = 0u;
        }
        if (i >= count) break;
        PixelSurface found = seen_on(view, corner + place_in_pixel(i, pixel), side);
        Surface surface = surface_at(side >> 1);
        vec3 facet = facet_of(surface, side);
        uint own = 0u;
        float least = 1e30;
        for (uint k = 0u; k < used; ++k) {
            float cost = dissimilarity(found, facet, shown[k]) + (materials[k] == surface.material ? 0.0 : 1e3);
            own = cost < least ? k : own;
            least = min(cost, least);
        }
        if (least > uintBitsToFloat(ALIKE) && used < most) {
            own = used++;
            shown[own] = found;
            materials[own] = surface.material;
        }
        uint place = compared++ % KNOWN;
        known_sides[place] = side;
        known_fragments = known_fragments & ~(15u << 4u * place) | own << 4u * place;
    }
    fragment_firsts[edge] = used;
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
