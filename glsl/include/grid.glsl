// Maps a point on a surface to its base cluster, alike for all passes. The including shader binds
// the words of the octree as `uint octree[]` (src/scene/octree.rs) and `uint cell_clusters[]`
// (cluster code << 26 | cluster). A split plane divides a cluster into two with consecutive
// indices: after the first follow a word with the code SPLIT and the four floats of the plane.
const uint SPLIT = 63u;
// Marks the word of a brick, which has 8×8×8 cells.
const uint BRICK = 0x80000000u;
const uint BRICK_BITS = 3u;
// Words before the top nodes: index of the first cell, the finest cell at `Grid.low`, and the width
// of a top node (two to that power, in finest cells).
const uint HEADER = 5u;

struct Cell {
    uint word;   // index of its word
    uint level;  // its width is two to that power, in finest cells
};

// The cell of a point on the side that `normal` faces. The point is first pulled inside the
// surface, so that each side of a wall on a cell boundary falls into the cell behind it.
Cell cell_at(Grid grid, vec3 position, vec3 normal) {
    precise vec3 inside = position - grid.pull * normal;
    precise vec3 scaled = (inside - grid.low) * grid.inverse_cell;
    ivec3 place = ivec3(floor(clamp(scaled, -1e9, 1e9))) + ivec3(octree[1], octree[2], octree[3]);
    uvec3 cell = uvec3(clamp(place, ivec3(0), ivec3(grid.cells) - 1));
    uint bits = octree[4];
    uvec3 nodes = (grid.cells - 1u >> bits) + 1u;
    uvec3 node = cell >> bits;
    uint word = octree[HEADER + (node.z * nodes.y + node.y) * nodes.x + node.x];
    while ((word & BRICK) == 0u) {
        --bits;
        uvec3 octant = cell >> bits & 1u;
        word = octree[word + (octant.x | octant.y << 1 | octant.z << 2)];
    }
    uint level = bits - BRICK_BITS;
    uvec3 inner = cell >> level & (1u << BRICK_BITS) - 1u;
    return Cell((word & ~BRICK) + ((inner.z << BRICK_BITS | inner.y) << BRICK_BITS | inner.x), level);
}

// Base cluster of a side's cluster code in a cell, or NO_CLUSTER. Of a divided cluster it returns
// the one on the position's side of the split plane.
uint base_cluster(Cell cell, uint code, vec3 position) {
    uint end = octree[cell.word + 1u];
    for (uint i = octree[cell.word]; i < end; ++i) {
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
