// The cluster that a ray reads where it hits. Include after bvh.glsl and grid.glsl. The including
// shader binds `ClusterLink links[]` and `uint unweighted_clusters[]`, of base clusters; its push
// block `push` has `grid` and `min_entry_points`.

// What is so near, in base cells, shows its unweighted cluster.
const float NEARBY = 2.0;
// No light comes to covered surface, and what covers it sees no further than that, in base cells
// (`exposed_fractions`).
const float COVERED_SIGHT = 0.5;

// The cluster whose size fits a footprint as wide as that before it is projected to the surface,
// metres; or coarser, until it is of the minimum count. NO_CLUSTER on a side without light, and for
// neighbours of covered surface on it.
uint cluster_for(Hit hit, vec3 direction, float footprint) {
    Surface surface = surface_at(hit.triangle);
    float facing = dot(surface.normal, direction);
    bool back = facing > 0.0;
    if (!side_is_active(surface.sides, back)) return NO_CLUSTER;
    vec3 normal = back ? -surface.normal : surface.normal;
    vec3 position = hit_position(hit);
    uint cell = grid_cell(push.grid, position, normal);
    uint cluster = base_cluster(cell, side_code(surface.sides, back), position);
    if (cluster == NO_CLUSTER) return NO_CLUSTER;
    // A coarser cluster would be that of surface in the open.
    bool is_covered = links[cluster].entry_points == 0.0 && hit.t * push.grid.inverse_cell < COVERED_SIGHT;
    if (is_covered) return NO_CLUSTER;
    bool is_near = hit.t * push.grid.inverse_cell < NEARBY;
    if (is_near && unweighted_clusters[cluster] != NO_CLUSTER) cluster = unweighted_clusters[cluster];

    float size = footprint * inversesqrt(max(abs(facing), 0.1)) * push.grid.inverse_cell;
    for (; size >= 1.41421356 && links[cluster].parent != NO_CLUSTER; size *= 0.5) {
        cluster = links[cluster].parent;
    }
    while (links[cluster].entry_points < push.min_entry_points && links[cluster].parent != NO_CLUSTER) {
        cluster = links[cluster].parent;
    }
    return cluster;
}
