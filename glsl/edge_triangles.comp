// Antialiasing, step 4: the triangles that camera rays through an edge pixel may meet. Triangles
// behind one that fills the pixel are left out. Lists the pixels with too many. The list is
// unordered, because each pixel is sampled by itself. One invocation = one edge pixel. In: edge
// pixels, triangles of their tiles. Out: their triangles; the list, its length, sizes of dispatches
// over its samples and its pixels; initially zero.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/quirks.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct EdgeSamplesPush {
    View view;
    EdgeCapacity capacity;
    float smooth_m2;  // see fragments
};

layout(binding = 0) uniform usamplerBuffer Triangles;
layout(scalar, binding = 1) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 2) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 3) uniform usamplerBuffer TileTriangles;
layout(scalar, binding = 4) buffer EdgeTriangles { uint edge_triangles[]; };
layout(scalar, binding = 5) buffer DenseEdges { uint dense_edges[]; };
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

#include "include/triangles.glsl"
#include "include/projected.glsl"

// Half of the size of a pixel over the true one: more than rounding takes.
const float MARGIN = 1.05;

// Whether a ray through a pixel may meet a triangle. `reach` is the largest difference of its edge
// functions from those at the centre.
bool may_meet(Projected triangle, vec3 reach, vec2 half_size) {
    bool is_outside = any(lessThan(triangle.at_centre + reach, vec3(0.0))) && any(greaterThan(triangle.at_centre - reach, vec3(0.0)));
    vec3 wide = half_size.x * triangle.depths;
    vec3 high = half_size.y * triangle.depths;
    is_outside = is_outside || all(lessThan(triangle.xs, -wide)) || all(greaterThan(triangle.xs, wide));
    is_outside = is_outside || all(lessThan(triangle.ys, -high)) || all(greaterThan(triangle.ys, high));
    return !is_outside && any(greaterThan(triangle.depths, vec3(0.0)));
}

// Largest depth of a triangle in a pixel that it fills, and a margin for rounding: a triangle does
// not hide itself.
float farthest(Projected triangle, vec2 half_size) {
    float far = 0.0;
    for (uint i = 0u; i < 4u; ++i) {
        vec2 corner = mix(-half_size, half_size, vec2(i & 1u, i >> 1));
        far = max(far, depth_of(triangle, edges_at(triangle, corner)));
    }
    return 1.001 * far;
}

// Least depth of a triangle's corners.
float nearest(View view, Corners corners) {
    vec3 depths = vec3(dot(corners.p0 - view.position, view.forward), dot(corners.p1 - view.position, view.forward), dot(corners.p2 - view.position, view.forward));
    return min(depths.x, min(depths.y, depths.z));
}

void main() {
    View view = push.view;
    uint edge = flat_invocation();
    uint edge_count = edge_numbers[view.width * view.height];
    if (edge >= edge_count) return;
    uint most = edge < edges_in(push.capacity) ? EDGE_WORDS - 1u : 0u;
    uvec2 pixel = in_rows(edge_pixels[edge], view.width);
    uint tile = pixel.y / 8u * ((view.width + 7u) / 8u) + pixel.x / 8u;
    vec2 centre = centre_of(view, pixel);
    vec2 half_size = 0.5 * MARGIN * pixel_size(view);
    uint listed = tile < push.capacity.tiles ? word_at(TileTriangles, tile * TILE_WORDS) : TOO_MANY;
    uint first = edge * EDGE_WORDS;
    float far = 1e30;
    uint found = listed == TOO_MANY ? TOO_MANY : 0u;
    for (uint i = 1u; i <= listed && found <= most; ++i) {
        uint triangle = word_at(TileTriangles, tile * TILE_WORDS + i);
        Projected seen = projected(view, centre, corners_of(triangle));
        vec3 reach = half_size.x * abs(seen.along_x) + half_size.y * abs(seen.along_y);
        float near = min(seen.depths.x, min(seen.depths.y, seen.depths.z));
        if (near > far || !may_meet(seen, reach, half_size)) continue;
        bool fills = all(greaterThanEqual(seen.at_centre, reach)) || all(lessThanEqual(seen.at_centre, -reach));
        if_any (fills && near > 0.0 && !has_holes(triangle)) far = min(far, farthest(seen, half_size));
        ++found;
        if (found <= most) edge_triangles[first + found] = triangle;
    }
    bool is_dense = found > most;
    // Those found before the one that hides them.
    uint kept = 0u;
    for (uint i = 1u; i <= found && !is_dense; ++i) {
        uint triangle = edge_triangles[first + i];
        if (nearest(view, corners_of(triangle)) > far) continue;
        ++kept;
        edge_triangles[first + kept] = triangle;
    }
    if (most > 0u) edge_triangles[first] = is_dense ? TOO_MANY : kept;
    if (!is_dense) return;
    uint place = atomicAdd(dense_edges[3], 1u);
    dense_edges[DENSE_HEADER + place] = edge;
    uint samples = samples_per_edge(edge_count, push.capacity);
    for (uint axis = 0u; axis < 3u; ++axis) {
        atomicMax(dense_edges[axis], swizzled(((place + 1u) * samples + 63u) / 64u)[axis]);
        atomicMax(dense_edges[4u + axis], swizzled((place + 64u) / 64u)[axis]);
    }
}
