// Antialiasing, step 5: the surfaces at samples spread over the edge pixels, among the triangles of
// each. Deterministic. One invocation = OWN_SAMPLES samples of a pixel, which share the work for a
// triangle. In: camera, scene, edge pixels, their triangles. Out: the samples, without their
// fragments.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/edge_places.glsl"

layout(local_size_x = 64) in;

struct EdgeSamplesPush {
    View view;
    EdgeCapacity capacity;
    float smooth_m2;  // see fragments
};

layout(binding = 0) uniform usamplerBuffer Triangles;
layout(binding = 1) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 2) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 3) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 4) uniform usamplerBuffer EdgeTriangles;
layout(scalar, binding = 5) writeonly buffer EdgeSamples { uint edge_samples[]; };
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/view.glsl"
#include "include/projected.glsl"

void main() {
    View view = push.view;
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint blocks = max(count / OWN_SAMPLES, 1u);
    uint index = flat_invocation();
    uvec2 number = in_rows(index, blocks);  // of the invocation in its pixel, of the pixel
    if (number.y >= min(edge_count, edges_in(push.capacity)) || count == 0u) return;
    uint first = number.y * EDGE_WORDS;
    uint listed = word_at(EdgeTriangles, first);
    if (listed == TOO_MANY) return;
    uint index_of_pixel = edge_pixels[number.y];
    uvec2 pixel = in_rows(index_of_pixel, view.width);
    vec2 centre = centre_of(view, pixel);
    vec2 offsets[OWN_SAMPLES];  // from the centre
    float depths[OWN_SAMPLES];
    uint seen[OWN_SAMPLES];     // triangles
    for (uint k = 0u; k < OWN_SAMPLES; ++k) {
        offsets[k] = pixel_size(view) * (place_in_pixel(number.x * OWN_SAMPLES + k, index_of_pixel) - 0.5);
        depths[k] = 1e30;
        seen[k] = 0u;
    }
    for (uint i = 1u; i <= listed; ++i) {
        uint triangle = word_at(EdgeTriangles, first + i);
        Projected shown = projected(view, centre, corners_of(triangle));
        for (uint k = 0u; k < OWN_SAMPLES; ++k) {
            vec3 edges = edges_at(shown, offsets[k]);
            float depth = depth_of(shown, edges);
            // Neither if the triangle is seen edge-on: the depth is then no number.
            bool is_met = is_inside(edges) && depth > 0.0 && depth < depths[k];
            if (HAS_CUTOUTS != 0u) is_met = is_met && !is_hole(triangle, edges / (edges.x + edges.y + edges.z));
            depths[k] = is_met ? depth : depths[k];
            seen[k] = is_met ? triangle : seen[k];
        }
    }
    for (uint k = 0u; k < OWN_SAMPLES; ++k) {
        uint sample_number = number.x * OWN_SAMPLES + k;
        vec3 direction = direction_through(view, vec2(pixel) + place_in_pixel(sample_number, index_of_pixel));
        uint side = 2u * seen[k] + uint(dot(surface_at(seen[k]).normal, direction) > 0.0);
        edge_samples[number.y * count + sample_number] = depths[k] < 1e30 ? side : NO_SIDE;
    }
}
