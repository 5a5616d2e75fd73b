// Antialiasing, step 1: marks the pixels at an edge of geometry or of a material. Deterministic.
// One invocation = one pixel, one workgroup = one tile of them. In: surfaces at the pixels. Out: in
// tile order, 1 for an edge pixel, else 0.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/records.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 0) const uint CREASE = 0;    // float bits: cosine below which neighbouring normals make an edge
layout(constant_id = 1) const uint STEP = 0;      // float bits: distance from the neighbour's plane that makes one, pixel widths

struct EdgeMarkPush {
    uint width;
    uint height;
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(binding = 1) uniform usamplerBuffer Pixels;
layout(scalar, binding = 2) writeonly buffer EdgeMarks { uint edge_marks[]; };
layout(scalar, push_constant) uniform Push { EdgeMarkPush push; };

#include "include/surfaces.glsl"

bool is_edge(PixelSurface a, PixelSurface b) {
    if (a.side == NO_SIDE || b.side == NO_SIDE) return a.side != b.side;
    if (surface_at(a.side >> 1).material != surface_at(b.side >> 1).material) return true;
    if (dot(a.normal, b.normal) < uintBitsToFloat(CREASE)) return true;
    // Smooth shading hides a sharp edge from direct light. Indirect light depends on the facet's
    // horizon and still shows it.
    if (dot(facet_of(surface_at(a.side >> 1), a.side), facet_of(surface_at(b.side >> 1), b.side)) < FACETS_ALIKE) return true;
    vec3 apart = b.position - a.position;
    float off_plane = min(abs(dot(apart, a.normal)), abs(dot(apart, b.normal)));
    return off_plane > uintBitsToFloat(STEP) * sqrt(max(a.footprint, b.footprint));
}

void main() {
    ivec2 size = ivec2(push.width, push.height);
    ivec2 xy = ivec2(gl_GlobalInvocationID.xy);
    bool is_inside = all(lessThan(xy, size));
    PixelSurface pixel = pixel_surface_at(Pixels, is_inside ? xy.y * size.x + xy.x : 0);
    bool found = false;
    for (int i = 1; i < 9 && is_inside && !found; i += 2) {
        // Above, left, right, below.
        ivec2 other = clamp(xy + ivec2(i % 3, i / 3) - 1, ivec2(0), size - 1);
        found = is_edge(pixel, pixel_surface_at(Pixels, other.y * size.x + other.x));
    }
    edge_marks[place_in_tiles(gl_GlobalInvocationID.xy, push.width)] = uint(found);
}
