// Antialiasing, step 3: traces samples spread over the edge pixels. Each sample takes the indirect
// light of one of the nine pixels around it, the one with the most similar surface: indirect light
// is smooth on a surface. If none is similar, or if pixels are not small beside cells, it is
// marked. Along the scene's outline a sample traces several image points. It shows
// the first surface that one of them meets, with the fraction of points that meet one as its
// weight. Deterministic. One invocation = one sample. In: camera, scene, pixels. Out: the samples;
// step 4 adds their slots.
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
layout(constant_id = 1) const uint ALIKE = 0;  // float bits: dissimilarity up to which a pixel serves a sample
layout(constant_id = 0) const uint OUTLINE_POINTS = 1;  // image points of a sample if a pixel around it sees no surface; a divisor of 8

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
layout(scalar, binding = 6) writeonly buffer EdgeSamples { EdgeSample edge_samples[]; };
layout(scalar, binding = 7) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/alike.glsl"

void main() {
    View view = push.view;
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint index = flat_invocation();
    if (index >= edge_count * count) return;
    uvec2 number = in_rows(index, count);  // of the sample in its pixel, of the pixel
    uint pixel = edge_pixels[number.y];
    uvec2 size = uvec2(view.width, view.height);
    vec2 corner = vec2(in_rows(pixel, size.x));
    bool is_outline = false;
    for (uint i = 0u; i < 9u; ++i) is_outline = is_outline || pixel_surface_at(Pixels, pixel_at(size, pixel, i)).side == NO_SIDE;
    PixelSurface found = PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);
    uint points = is_outline ? OUTLINE_POINTS : 1u;
    uint shown = 0u;
    uint met = 0u;
    for (uint k = 0u; k < points; ++k) {
        PixelSurface seen = seen_through(view, corner + sample_3d(number.x + k * count, pixel).xy);
        if (seen.side == NO_SIDE) continue;
        if (met == 0u) {
            found = seen;
            shown = k;
        }
        ++met;
    }

    float least = 1e30;
    uint place = 4u;
    vec3 facet = facing_normal(found.side);
    // The pixel itself comes first: if it is similar enough, the loop ends.
    for (uint i = 4u; i < 13u && found.side != NO_SIDE && least > 0.01; ++i) {
        PixelSurface candidate = pixel_surface_at(Pixels, pixel_at(size, pixel, i % 9u));
        float cost = candidate.side == NO_SIDE ? 1e30 : dissimilarity(found, facet, candidate);
        place = cost < least ? i % 9u : place;
        least = min(cost, least);
    }
    bool is_far = least > uintBitsToFloat(ALIKE) || (place != 4u && found.footprint > push.smooth_m2);
    uint apart = found.side != NO_SIDE && is_far ? IS_APART : 0u;
    edge_samples[index] = EdgeSample(found.side, shown | met * (8u / points) << 3 | place << 7 | apart);
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
