// Entry points: stratified over the patches of the active sides, in the patches' order. [Yue §1]
// Deterministic. One invocation = one entry point. In: index of the first point of every patch.
// Out: the first vertex of every light path.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/sampling.glsl"

layout(local_size_x = 64) in;

struct EntryPatch {
    vec3 p0;
    vec3 p1;
    vec3 p2;
    uint side;     // 2·triangle + (1 if the back side)
    float weight;  // area of each of its points, over the mean of all points
    uint stream;   // random stream index of its first point; the others' follow
};
struct EntryPointsPush {
    Grid grid;
    uint first_point;  // of this dispatch
    uint point_count;  // in it
    uint patch_count;
    uint seed;
};

layout(binding = 0) uniform usamplerBuffer Triangles;
layout(binding = 1) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 2) readonly buffer EntryPatches { EntryPatch entry_patches[]; };
layout(scalar, binding = 3) readonly buffer PointOffsets { uint point_offsets[]; };  // of each patch
layout(scalar, binding = 4) readonly buffer Octree { uint octree[]; };
layout(scalar, binding = 5) readonly buffer CellClusters { uint cell_clusters[]; };
layout(scalar, binding = 6) writeonly buffer EntryPoints { PathVertex entry_points[]; };
layout(scalar, push_constant) uniform Push { EntryPointsPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/grid.glsl"

// The patch whose segment of points holds `index`: the last one that starts at or before it.
uint find_patch(uint index) {
    uint low = 0u;
    uint high = push.patch_count;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (point_offsets[middle] <= index) low = middle;
        else high = middle;
    }
    return low;
}

void main() {
    if (flat_invocation() >= push.point_count) return;
    uint index = push.first_point + flat_invocation();
    uint patch_index = find_patch(index);
    EntryPatch entry_patch = entry_patches[patch_index];
    Corners triangle = corners_of(entry_patch.side >> 1);
    Surface surface = surface_at(entry_patch.side >> 1);
    bool back = (entry_patch.side & 1u) != 0u;

    // Consecutive points are neighbours on the surface; the sequence spreads them evenly.
    vec2 u = sample_3d(entry_patch.stream + index - point_offsets[patch_index], push.seed).xy;
    float along = sqrt(u.x);
    vec3 weights = vec3(1.0 - along, along * (1.0 - u.y), along * u.y);
    vec3 position = weights.x * entry_patch.p0 + weights.y * entry_patch.p1 + weights.z * entry_patch.p2;
    // Slightly off the triangle's edges: a ray from an edge may start in the plane of the next wall
    // and leave a closed room. See `hit_position`.
    position = mix(position, (triangle.p0 + triangle.p1 + triangle.p2) * (1.0 / 3.0), 1.0 / 32768.0);

    vec3 normal = back ? -surface.normal : surface.normal;
    uint cluster = base_cluster(cell_at(push.grid, position, normal), side_code(surface.sides, back), position);
    entry_points[flat_invocation()] = PathVertex(position, entry_patch.side, vec3(0.0), entry_patch.weight, cluster, 0.0);
}
