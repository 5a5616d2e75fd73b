// From a point on a surface to the base cluster that holds it: the one mapping that every stage shares.
// The including shader binds `uint cell_first[]` and `uint cell_clusters[]` (cluster code << 26 | cluster).

// Base cell of a point on the side that `normal` faces. The point is pulled inside the surface first, so that the two
// sides of a wall that lies on a cell boundary fall into the cells behind them, not into one by accident.
uint grid_cell(Grid grid, vec3 position, vec3 normal) {
    precise vec3 inside = position - grid.pull * normal;
    precise vec3 scaled = (inside - grid.low) * grid.inverse_cell;
    uvec3 cell = min(uvec3(max(scaled, vec3(0.0))), grid.cells - 1u);
    return (cell.z * grid.cells.y + cell.y) * grid.cells.x + cell.x;
}

// Base cluster of a side's cluster code in a cell, or NO_CLUSTER.
uint base_cluster(uint cell, uint code) {
    for (uint i = cell_first[cell]; i < cell_first[cell + 1u]; ++i) {
        if ((cell_clusters[i] >> 26) == code) return cell_clusters[i] & 0x03ffffffu;
    }
    return NO_CLUSTER;
}
