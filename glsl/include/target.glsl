// The cluster that a ray reads at its hit. Include after bvh.glsl and grid.glsl. The including
// shader binds `ClusterLink links[]` and `uint unweighted_clusters[]` (by base cluster); its push
// block `push` has `grid` and `min_entry_points`.

// Distance, in cells at the hit, within which a ray reads the unweighted cluster.
const float NEARBY = 2.0;
// Covered surface receives no light. The covering surface is within this distance, in
// cells (`exposed_fractions`).
const float COVERED_SIGHT = 0.5;

// The cluster whose size fits a footprint of that width (metres, before projection to the surface),
// or a coarser one that reaches the minimum sample count. NO_CLUSTER on an inactive side, and on
// covered surface within COVERED_SIGHT. `cells`: the distance, in widths of the base cell there.
uint cluster_for(Hit hit, vec3 direction, float footprint, out float cells) {
    cells = 0.0;
    Surface surface = surface_at(hit.triangle);
    float facing = dot(surface.normal, direction);
    bool back = facing > 0.0;
    if (!side_is_active(surface.sides, back)) return NO_CLUSTER;
    vec3 normal = back ? -surface.normal : surface.normal;
    vec3 position = hit_position(hit);
    Cell cell = cell_at(push.grid, position, normal);
    float inverse_cell = push.grid.inverse_cell / float(1u << cell.level);
    cells = hit.t * inverse_cell;
    uint cluster = base_cluster(cell, side_code(surface.sides, back), position);
    if (cluster == NO_CLUSTER) return NO_CLUSTER;
    // A coarser cluster would have the light of exposed surface.
    bool is_covered = links[cluster].entry_points == 0.0 && cells < COVERED_SIGHT;
    if (is_covered) return NO_CLUSTER;
    bool is_near = cells < NEARBY;
    if (is_near && unweighted_clusters[cluster] != NO_CLUSTER) cluster = unweighted_clusters[cluster];

    float size = footprint * inversesqrt(max(abs(facing), 0.1)) * inverse_cell;
    for (; size >= 1.41421356 && links[cluster].parent != NO_CLUSTER; size *= 0.5) {
        cluster = links[cluster].parent;
    }
    while (links[cluster].entry_points < push.min_entry_points && links[cluster].parent != NO_CLUSTER) {
        cluster = links[cluster].parent;
    }
    return cluster;
}

uint cluster_for(Hit hit, vec3 direction, float footprint) {
    float cells;
    return cluster_for(hit, direction, footprint, cells);
}
