// Antialiasing, step 3: the triangles that camera rays through a tile of 8×8 pixels may meet.
// Deterministic. One invocation = one tile. In: exclusive prefix sum of the edge marks in tile
// order, the tree. Out: triangles of the tiles with edge pixels.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct TileTrianglesPush {
    View view;
    EdgeCapacity capacity;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(scalar, binding = 2) readonly buffer EdgeMarks { uint edge_marks[]; };

#include "include/triangles.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"

layout(scalar, binding = 3) writeonly buffer TileTriangles { uint roots[]; };
layout(scalar, push_constant) uniform Push { TileTrianglesPush push; };

const uint MAX_ROOTS = TILE_WORDS - 1u;
// Few enough that the loops end within the iteration limit: see quirks.glsl.
const uint MAX_OPENED = 512u;

// Margin of a frustum around its tile, in pixels: more than rounding takes.
const float MARGIN = 1.0 / 64.0;

struct Frustum {
    vec3 apex;
    vec3 corners[4];  // unit directions
    vec3 planes[4];   // unit normals to the outside
    float clear;      // rounding error of a distance from a plane
};

Frustum frustum;  // of this invocation's tile

Frustum frustum_of(View view, vec2 low, vec2 high) {
    Frustum made;
    made.apex = view.position;
    made.clear = scene_clear_distance();
    for (uint i = 0u; i < 4u; ++i) {
        vec2 side = vec2(i == 1u || i == 2u, i >= 2u);
        made.corners[i] = normalize(direction_through(view, mix(low - MARGIN, high + MARGIN, side)));
    }
    for (uint i = 0u; i < 4u; ++i) {
        vec3 normal = normalize(cross(made.corners[i], made.corners[(i + 1u) % 4u]));
        made.planes[i] = dot(normal, made.corners[(i + 2u) % 4u]) > 0.0 ? -normal : normal;
    }
    return made;
}

bool is_outside(vec3 low, vec3 high) {
    bool found = false;
    for (uint i = 0u; i < 4u; ++i) {
        vec3 nearest = mix(high, low, greaterThan(frustum.planes[i], vec3(0.0)));
        found = found || dot(frustum.planes[i], nearest - frustum.apex) > frustum.clear;
    }
    return found;
}

// Whether all of the frustum lies beyond the plane through its apex and an edge, as seen from the
// third corner.
bool is_beyond(vec3 a, vec3 b, vec3 third) {
    vec3 across = cross(a, b);
    float inside = dot(across, third) < 0.0 ? -1.0 : 1.0;
    float most = -1e30;
    for (uint i = 0u; i < 4u; ++i) most = max(most, inside * dot(across, frustum.corners[i]));
    return most < -frustum.clear * (length(a) + length(b)) - 1e-6 * length(a) * length(b);
}

// False if no ray of the frustum can meet a triangle.
bool is_inside(Corners triangle) {
    vec3 a = triangle.p0 - frustum.apex;
    vec3 b = triangle.p1 - frustum.apex;
    vec3 c = triangle.p2 - frustum.apex;
    for (uint i = 0u; i < 4u; ++i) {
        vec3 plane = frustum.planes[i];
        if (min(dot(plane, a), min(dot(plane, b), dot(plane, c))) > frustum.clear) return false;
    }
    return !(is_beyond(a, b, c) || is_beyond(b, c, a) || is_beyond(c, a, b));
}

#include "include/open_tree.glsl"

void main() {
    uint tile = flat_invocation();
    View view = push.view;
    uint tiles = min(tiles_around(uvec2(view.width, view.height)), push.capacity.tiles);
    if (tile >= tiles || edge_marks[64u * tile] == edge_marks[64u * tile + 64u]) return;
    vec2 low = vec2(corner_of_tile(tile, 8u, view.width));
    frustum = frustum_of(view, low, low + 8.0);
    uint first = tile * TILE_WORDS;
    uint found = open_tree(first);
    roots[first] = found >> 16 == 0u ? found : TOO_MANY;
}
