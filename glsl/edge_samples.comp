// Antialiasing, step 3: what samples spread over the edge pixels see, and for each the pixel around it whose
// surface it most resembles: indirect light is smooth on a surface, so that pixel's will do. Along the scene's outline a sample
// asks several points, shows the first surface that one of them meets, and counts for the share that do. Deterministic.
// One invocation = one sample. In: camera, scene, pixels. Out: surfaces of the samples, NO_SIDE for those to spare; sources.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/records.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint OUTLINE_POINTS = 1;  // of a sample, where a pixel around it sees no surface

struct EdgeSamplesPush {
    View view;
    uint most_samples;  // of a pixel
    uint capacity;      // samples that there is room for
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, binding = 4) readonly buffer EdgeOffsets { uint edge_offsets[]; };
layout(scalar, binding = 5) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 6) writeonly buffer EdgeSurfaces { PixelSurface edge_surfaces[]; };
layout(scalar, binding = 7) writeonly buffer EdgeSources { EdgeSource edge_sources[]; };
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/bvh.glsl"
#include "include/primary.glsl"

// How far a pixel's surface is from being that of a sample: turned by so much, off its plane by so many pixel widths,
// on a facet with another horizon.
float dissimilarity(PixelSurface found, PixelSurface pixel) {
    vec3 apart = pixel.position - found.position;
    float facing = dot(facet_of(surfaces[found.side >> 1], found.side), facet_of(surfaces[pixel.side >> 1], pixel.side));
    return 1.0 - dot(found.normal, pixel.normal) + abs(dot(apart, found.normal)) * inversesqrt(found.footprint)
         + 1e-3 * dot(apart, apart) / found.footprint + (facing < FACETS_ALIKE ? 1.0 : 0.0);
}

void main() {
    View view = push.view;
    uint edge_count = edge_offsets[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.most_samples, push.capacity);
    uint index = flat_invocation();
    if (index >= push.capacity) return;
    PixelSurface found = PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);
    EdgeSource source = EdgeSource(0u, 0u, 1.0);
    for (bool is_due = index < edge_count * count; is_due; is_due = false) {
        uint pixel = edge_pixels[index / count];
        ivec2 size = ivec2(view.width, view.height);
        ivec2 xy = ivec2(pixel % view.width, pixel / view.width);
        bool is_outline = false;
        for (int i = 0; i < 9; ++i) {
            ivec2 other = clamp(xy + ivec2(i % 3, i / 3) - 1, ivec2(0), size - 1);
            is_outline = is_outline || pixels[other.y * size.x + other.x].side == NO_SIDE;
        }
        source = EdgeSource(pixel, index % count, 0.0);
        uint points = is_outline ? OUTLINE_POINTS : 1u;
        uint met = 0u;
        for (uint k = 0u; k < points; ++k) {
            uint number = index % count + k * count;
            PixelSurface seen = seen_through(view, vec2(xy) + sample_3d(number, pixel).xy);
            if (seen.side == NO_SIDE) continue;
            if (met == 0u) {
                found = seen;
                source.number = number;
            }
            ++met;
        }
        source.share = float(met) / float(points);

        float least = 1e30;
        // The pixel itself first: if it will do, the others need not be asked.
        for (int i = 4; i < 13 && found.side != NO_SIDE && least > 0.01; ++i) {
            ivec2 other = clamp(xy + ivec2(i % 9 % 3, i % 9 / 3) - 1, ivec2(0), size - 1);
            uint neighbour = uint(other.y * size.x + other.x);
            PixelSurface candidate = pixels[neighbour];
            float cost = candidate.side == NO_SIDE ? 1e30 : dissimilarity(found, candidate);
            source.pixel = cost < least ? neighbour : source.pixel;
            least = min(cost, least);
        }
    }
    edge_surfaces[index] = found;
    edge_sources[index] = source;
}
