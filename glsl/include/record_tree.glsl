// The record tree: which records can have weight at a position. A position asks the cells around
// it, the largest first. The including shader binds the
// texels `TreeCells` and includes texels.glsl.

// How a position becomes a cell of the tree's deepest level.
struct TreeGrid {
    vec3 low;     // lowest corner of the root, metres
    float scale;  // cells of the deepest level a metre
    uint valid;   // root cell of the tree of valid records
    uint relaxed; // root cell of the tree of relaxed records
};

// As in src/passes/frame/record_tree.rs.
const uint LEVELS = 20u;         // below the root
const uint EMPTY = 0xffffffffu;  // no children, no list

// A way from the root to the leaf around a position.
struct TreeWalk {
    uvec3 place;  // cell of the deepest level
    uint level;   // of the cell, from LEVELS at the root
    uint cell;    // or EMPTY
};

TreeWalk walk_from(TreeGrid grid, uint root, vec3 position) {
    vec3 place = (position - grid.low) * grid.scale;
    bool is_inside = all(greaterThanEqual(place, vec3(0.0))) && all(lessThan(place, vec3(1u << LEVELS)));
    return TreeWalk(uvec3(place), LEVELS, is_inside ? root : EMPTY);
}

// List of the records that rest in the walk's cell, or EMPTY; then moves to its child.
uint next_list(inout TreeWalk walk) {
    uvec2 cell = pair_at(TreeCells, walk.cell);  // the first child, the list
    --walk.level;
    uvec3 side = walk.place >> walk.level & 1u;
    walk.cell = cell.x == EMPTY ? EMPTY : cell.x + (side.x | side.y << 1 | side.z << 2);
    return cell.y;
}
