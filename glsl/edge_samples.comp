// Antialiasing, step 5: the surfaces at samples spread over the edge pixels, among the triangles of
// each, and their fragments. Deterministic. One invocation = one pixel. In: camera, scene, edge
// pixels, their triangles. Out: the samples; masks of those of each fragment; the number of
// fragments.
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
layout(binding = 5) uniform usamplerBuffer EdgeTriangles;
layout(scalar, binding = 6) writeonly buffer EdgeSamples { uint edge_samples[]; };
layout(scalar, binding = 7) writeonly buffer SampleMasks { uvec4 sample_masks[]; };
layout(scalar, binding = 8) writeonly buffer FragmentFirsts { uint fragment_firsts[]; };  // of each edge pixel; initially zero
layout(scalar, binding = 9) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/alike.glsl"
#include "include/projected.glsl"
#include "include/edge_fragments.glsl"

// Puts the sides that samples from number `first` on see into `seen`, up to the last of `count`.
void cover(uint edge, uint pixel, uint first, uint count) {
    View view = push.view;
    vec2 centre = centre_of(view, in_rows(pixel, view.width));
    uvec2 fractions = flips_of(pixel) ^ sobol_2d(first);
    vec2 offsets[MASKED];          // from the centre
    float inverse_depths[MASKED];  // of what is seen
    for (uint k = 0u; k < MASKED; ++k) {
        offsets[k] = pixel_size(view) * (unit_floats(fractions ^ sobol_2d(k)) - 0.5);
        inverse_depths[k] = 0.0;
        seen[k] = NO_SIDE;
    }
    uint listed = word_at(EdgeTriangles, edge * EDGE_WORDS);
    for (uint i = 1u; i <= listed; ++i) {
        uint triangle = word_at(EdgeTriangles, edge * EDGE_WORDS + i);
        Compared shown = compared(projected(view, centre, corners_of(triangle)));
        uint side = 2u * triangle + uint(shown.is_back);
        for (uint k = 0u; k < MASKED; ++k) {
            vec3 edges = edges_at(shown, offsets[k]);
            float inverse_depth = inverse_depth_at(shown, offsets[k]);
            bool is_met = min(edges.x, min(edges.y, edges.z)) >= 0.0 && inverse_depth > inverse_depths[k];
            if (HAS_CUTOUTS != 0u) is_met = is_met && !is_hole(triangle, edges / (edges.x + edges.y + edges.z));
            inverse_depths[k] = is_met ? inverse_depth : inverse_depths[k];
            seen[k] = is_met ? side : seen[k];
        }
    }
    for (uint k = 0u; k < MASKED; ++k) seen[k] = first + k < count ? seen[k] : NO_SIDE;
}

void main() {
    View view = push.view;
    uint edge = flat_invocation();
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    if (edge >= min(edge_count, edges_in(push.capacity)) || word_at(EdgeTriangles, edge * EDGE_WORDS) == TOO_MANY) return;
    uint pixel = edge_pixels[edge];
    uint most = fragments_per_edge(edge_count, push.capacity);
    EdgeFragments fragments = no_fragments();
    for (uint first = 0u; first < count; first += MASKED) {
        cover(edge, pixel, first, count);
        for (uint k = 0u; k < min(MASKED, count - first); ++k) edge_samples[edge * count + first + k] = seen[k];
        sample_masks[edge * masks_of(count) + first / MASKED] = group_samples(fragments, view, pixel, first, most);
    }
    fragment_firsts[edge] = fragments.used;
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
