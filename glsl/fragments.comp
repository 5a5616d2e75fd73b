// Antialiasing, step 8: makes the fragments. The point of a fragment is the surface at the sample
// closest to the middle of all, because the middle itself may be hidden. Its normal is the mean
// over some samples, shorter than one on a curved surface. The fragment takes the indirect light
// of one of the nine pixels around, the one with the most similar surface: indirect light is
// smooth on a surface. It needs a point of its own if none is similar, or if pixels are not small
// beside cells. Deterministic. One invocation = one edge pixel. In: samples, exclusive prefix sum
// of the numbers of fragments, pixels. Out: fragments, their points; whether each needs indirect
// light of its own; dispatch sizes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/quirks.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/edge_places.glsl"
#include "include/records.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ALIKE = 0;  // float bits: dissimilarity up to which a pixel shows the surface of a fragment
layout(constant_id = 1) const uint GROUP_POINTS = 256;  // values of light that a workgroup sums

struct EdgeSamplesPush {
    View view;
    EdgeCapacity capacity;
    float smooth_m2;  // area of a pixel up to which indirect light is smooth over it and its neighbours
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Pixels;
layout(scalar, binding = 4) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 5) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 6) uniform usamplerBuffer EdgeSamples;
layout(binding = 7) uniform usamplerBuffer SampleMasks;  // a texel: those of each fragment
layout(scalar, binding = 8) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(scalar, binding = 9) writeonly buffer Fragments { Fragment fragments[]; };
layout(scalar, binding = 10) writeonly buffer FragmentSurfaces { PixelSurface fragment_surfaces[]; };
layout(scalar, binding = 11) writeonly buffer PointNumbers { uint point_numbers[]; };  // of each fragment; initially zero
layout(scalar, binding = 12) writeonly buffer EdgeGroups { uint edge_groups[]; };
layout(scalar, binding = 13) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/alike.glsl"
#include "include/edge_groups.glsl"

void main() {
    View view = push.view;
    uvec2 size = uvec2(view.width, view.height);
    uint pixel_count = size.x * size.y;
    uint edge_count = edge_numbers[pixel_count];
    uint edge = flat_invocation();
    if (edge == 0u) put_fragments(pixel_count, fragment_firsts[edge_count], GROUP_POINTS);
    if (edge >= edge_count) return;
    uint count = samples_per_edge(edge_count, push.capacity);
    uint pixel = edge_pixels[edge];
    vec2 corner = vec2(in_rows(pixel, size.x));
    uvec2 flips = flips_of(pixel);
    vec2 middles[MAX_FRAGMENTS];
    uint members[MAX_FRAGMENTS];
    for (uint k = 0u; k < MAX_FRAGMENTS; ++k) {
        middles[k] = vec2(0.0);
        members[k] = 0u;
    }
    uint masks_each = masks_of(count);
    for (uint word = 0u; word < masks_each; ++word) {
        uvec4 masks = texelFetch(SampleMasks, int(edge * masks_each + word));
        uvec2 fractions = flips ^ sobol_2d(word * MASKED);
        for (uint i = 0u; i < MASKED; ++i) {
            vec2 place = unit_floats(fractions ^ sobol_2d(i));
            for (uint k = 0u; k < MAX_FRAGMENTS; ++k) middles[k] += (masks[k] & 1u << i) != 0u ? place : vec2(0.0);
        }
        for (uint k = 0u; k < MAX_FRAGMENTS; ++k) members[k] += bitCount(masks[k]);
    }
    uint nearest[MAX_FRAGMENTS];  // sample to the middle
    float apart2[MAX_FRAGMENTS];  // its squared distance
    for (uint k = 0u; k < MAX_FRAGMENTS; ++k) {
        middles[k] /= float(max(members[k], 1u));
        nearest[k] = 0u;
        apart2[k] = 1e30;
    }
    for (uint word = 0u; word < masks_each; ++word) {
        uvec4 masks = texelFetch(SampleMasks, int(edge * masks_each + word));
        uvec2 fractions = flips ^ sobol_2d(word * MASKED);
        for (uint i = 0u; i < MASKED; ++i) {
            vec2 place = unit_floats(fractions ^ sobol_2d(i));
            for (uint k = 0u; k < MAX_FRAGMENTS; ++k) {
                vec2 apart = place - middles[k];
                bool is_nearer = (masks[k] & 1u << i) != 0u && dot(apart, apart) < apart2[k];
                apart2[k] = is_nearer ? dot(apart, apart) : apart2[k];
                nearest[k] = is_nearer ? word * MASKED + i : nearest[k];
            }
        }
    }

    uint first = fragment_firsts[edge];
    uint own_count = fragment_firsts[edge + 1u] - first;
    PixelSurface shown[MAX_FRAGMENTS];
    vec3 facets[MAX_FRAGMENTS];
    bool varies = false;  // the normal of a fragment
    for (uint k = 0u; k < own_count; ++k) {
        shown[k] = seen_on(view, corner + place_in_pixel(nearest[k], pixel), word_at(EdgeSamples, edge * count + nearest[k]));
        facets[k] = facing_normal(shown[k].side);
        varies = varies || dot(shown[k].normal, facets[k]) < FLAT;
    }
    // Samples over which the normals are averaged.
    uint averaged = count / COVERAGE;
    for (uint i = 0u; i < averaged; ++i) {
        uint side = word_at(EdgeSamples, edge * count + i);
        uint own = fragment_of(SampleMasks, edge * masks_each, i);
        for (uint k = 0u; k < MAX_FRAGMENTS; ++k) varies = varies || (own == k && side != shown[k].side);
    }
    if_any (varies) {
        vec3 normals[MAX_FRAGMENTS];
        float weights[MAX_FRAGMENTS];
        for (uint k = 0u; k < MAX_FRAGMENTS; ++k) {
            normals[k] = vec3(0.0);
            weights[k] = 0.0;
        }
        for (uint i = 0u; i < averaged; ++i) {
            uint own = fragment_of(SampleMasks, edge * masks_each, i);
            if (own == MAX_FRAGMENTS) continue;
            vec3 normal = seen_on(view, corner + place_in_pixel(i, pixel), word_at(EdgeSamples, edge * count + i)).normal;
            for (uint k = 0u; k < MAX_FRAGMENTS; ++k) {
                float weight = own == k ? 1.0 : 0.0;
                normals[k] += weight * normal;
                weights[k] += weight;
            }
        }
        // A light's mean cosine is that with the mean normal, whose length is below one.
        for (uint k = 0u; k < own_count; ++k) shown[k].normal = weights[k] > 0.0 ? normals[k] / weights[k] : shown[k].normal;
    }

    for (uint k = 0u; k < own_count; ++k) {
        PixelSurface found = shown[k];
        vec3 facet = facets[k];
        float least = 1e30;
        uint place = 4u;
        uint alike = 0u;
        // The pixel itself comes first: if it is similar enough, it is taken.
        for (uint i = 4u; i < 13u; ++i) {
            PixelSurface candidate = pixel_surface_at(Pixels, pixel_at(size, pixel, i % 9u));
            float cost = candidate.side == NO_SIDE ? 1e30 : dissimilarity(found, facet, candidate);
            if (cost <= uintBitsToFloat(ALIKE)) alike |= 1u << i % 9u;
            if (least <= 0.01) continue;
            place = cost < least ? i % 9u : place;
            least = min(cost, least);
        }
        bool is_far = least > uintBitsToFloat(ALIKE) || (place != 4u && found.footprint > push.smooth_m2);
        fragments[first + k] = Fragment(edge, place | uint(is_far) << 4 | alike << 5 | members[k] << 14, NO_POINT, 0u);
        fragment_surfaces[first + k] = found;
        point_numbers[first + k] = uint(is_far);
    }
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
