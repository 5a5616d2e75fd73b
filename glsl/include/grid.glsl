// From a point on a surface to the base cluster that holds it: the one mapping that every stage
// shares. The including shader binds `uint cell_offsets[]` and `uint cell_clusters[]` (cluster code
// << 26 | cluster). A cluster that a wall stands on is two, which are numbered one after the other:
// behind the first a word with the code SPLIT follows, and the bits of the wall's plane.
const uint SPLIT = 63u;

// Base cell of a point on the side that `normal` faces. The point is pulled inside the surface
// first, so that the two sides of a wall that lies on a cell boundary fall into the cells behind
// them, not into one by accident.
uint grid_cell(Grid grid, vec3 position, vec3 normal) {
    precise vec3 inside = position - grid.pull * normal;
    precise vec3 scaled = (inside - grid.low) * grid.inverse_cell;
    uvec3 cell = min(uvec3(max(scaled, vec3(0.0))), grid.cells - 1u);
    return (cell.z * grid.cells.y + cell.y) * grid.cells.x + cell.x;
}

// Base cluster of a side's cluster code in a cell, or NO_CLUSTER; of two, that on the position's
// side of the wall.
uint base_cluster(uint cell, uint code, vec3 position) {
    uint end = cell_offsets[cell + 1u];
    for (uint i = cell_offsets[cell]; i < end; ++i) {
        uint cluster = cell_clusters[i] & 0x03ffffffu;
        bool is_found = (cell_clusters[i] >> 26) == code;
        if (i + 1u < end && (cell_clusters[i + 1u] >> 26) == SPLIT) {
            vec3 normal = uintBitsToFloat(uvec3(cell_clusters[i + 2u], cell_clusters[i + 3u], cell_clusters[i + 4u]));
            if (!(dot(normal, position) < uintBitsToFloat(cell_clusters[i + 5u]))) ++cluster;
            i += 5u;
        }
        if (is_found) return cluster;
    }
    return NO_CLUSTER;
}
