// Maps a point on a surface to its base cluster, alike for all passes. The including shader binds
// `uint cell_offsets[]` and `uint cell_clusters[]` (cluster code << 26 | cluster). A split plane
// divides a cluster into two with consecutive indices: after the first follow a word with the code
// SPLIT and the four floats of the plane.
const uint SPLIT = 63u;

// Base cell of a point on the side that `normal` faces. The point is first pulled inside the
// surface, so that each side of a wall on a cell boundary falls into the cell behind it.
uint grid_cell(Grid grid, vec3 position, vec3 normal) {
    precise vec3 inside = position - grid.pull * normal;
    precise vec3 scaled = (inside - grid.low) * grid.inverse_cell;
    uvec3 cell = min(uvec3(max(scaled, vec3(0.0))), grid.cells - 1u);
    return (cell.z * grid.cells.y + cell.y) * grid.cells.x + cell.x;
}

// Base cluster of a side's cluster code in a cell, or NO_CLUSTER. Of a divided cluster it returns
// the one on the position's side of the split plane.
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
