// Antialiasing, step 7: groups the samples of the pixels of step 6 into fragments. Deterministic.
// One invocation = one pixel. In: these pixels, surfaces at the samples. Out: masks of the samples
// of each fragment; the number of fragments.
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
layout(scalar, binding = 5) readonly buffer DenseEdges { uint dense_edges[]; };
layout(binding = 6) uniform usamplerBuffer EdgeSamples;
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
#include "include/edge_fragments.glsl"

void main() {
    View view = push.view;
    if (flat_invocation() >= dense_edges[3]) return;
    uint edge = dense_edges[DENSE_HEADER + flat_invocation()];
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint pixel = edge_pixels[edge];
    EdgeFragments fragments = no_fragments();
    for (uint first = 0u; first < count; first += MASKED) {
        for (uint k = 0u; k < MASKED; ++k) seen[k] = first + k < count ? word_at(EdgeSamples, edge * count + first + k) : NO_SIDE;
        uvec4 masks = group_samples(fragments, view, pixel, first, fragments_per_edge(edge_count, push.capacity));
        sample_masks[edge * masks_of(count) + first / MASKED] = masks;
    }
    fragment_firsts[edge] = fragments.used;
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
