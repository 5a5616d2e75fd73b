// Entry points: uniform over the active sides' area, stratified along its running sum. [Yue §1] Deterministic.
// One invocation = one entry point. In: first point of every active side. Out: the first vertex of every light path.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct EntryPointsPush {
    Grid grid;
    uint point_count;
    uint side_count;  // active sides
};

layout(scalar, binding = 0) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 1) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 2) readonly buffer ActiveSides { uint active_sides[]; };
layout(scalar, binding = 3) readonly buffer FirstPoints { uint first_points[]; };  // of each active side, and the total
layout(scalar, binding = 4) readonly buffer CellFirst { uint cell_first[]; };
layout(scalar, binding = 5) readonly buffer CellClusters { uint cell_clusters[]; };
layout(scalar, binding = 6) writeonly buffer EntryPoints { PathVertex entry_points[]; };
layout(scalar, push_constant) uniform Push { EntryPointsPush push; };

#include "include/grid.glsl"

// The active side whose run of points holds `index`: the last one whose first point is not beyond it.
uint find_side(uint index) {
    uint low = 0u;
    uint high = push.side_count;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (first_points[middle] <= index) low = middle;
        else high = middle;
    }
    return low;
}

void main() {
    uint index = flat_invocation();
    if (index >= push.point_count) return;
    uint slot = find_side(index);
    uint side = active_sides[slot];
    Triangle triangle = triangles[side >> 1];
    Surface surface = surfaces[side >> 1];
    bool back = (side & 1u) != 0u;

    // Hammersley points over the side, mapped to the triangle with constant density. Half a step of offset per side
    // keeps the two sides of one triangle from sharing their points; in v it keeps the first point off the edge, where
    // a ray would start in the plane of the next wall and leave a closed room.
    uint run = first_points[slot + 1u] - first_points[slot];
    uint rank = index - first_points[slot];
    float u = (float(rank) + (back ? 0.25 : 0.75)) / float(run);
    float v = float(bitfieldReverse(rank) >> 8) * (1.0 / 16777216.0) + 0.5 / float(run);
    float along = sqrt(u);
    // Off the edges by a hair: see `hit_position`.
    vec3 weights = mix(vec3(1.0 - along, along * (1.0 - v), along * v), vec3(1.0 / 3.0), 1.0 / 32768.0);
    vec3 position = weights.x * triangle.p0 + weights.y * triangle.p1 + weights.z * triangle.p2;

    vec3 normal = back ? -surface.normal : surface.normal;
    uint cluster = base_cluster(grid_cell(push.grid, position, normal), side_code(surface.sides, back));
    entry_points[index] = PathVertex(position, side, vec3(0.0), 1.0, cluster);
}
