// The record tree: which records can have weight at a position. A position asks the cells around
// it, the largest first. The including shader binds the
// texels `TreeNodes` and includes texels.glsl.

// How a position becomes a cell of the tree's deepest level.
struct TreeGrid {
    vec3 low;     // lowest corner of the root, metres
    float scale;  // cells of the deepest level a metre
    uint valid;   // root of the tree of valid records
    uint relaxed; // root of the tree of relaxed records
};

// As in src/passes/frame/record_tree.rs.
const uint LEVELS = 20u;             // below the root
const uint EMPTY = 0xffffffffu;      // no child, no list
const uint IS_LEAF = 0x80000000u;    // marks a leaf; the other bits are its list
const uint NODE_WORDS = 9u;          // eight children, the list of its own records

// A way from the root to the leaf around a position.
struct TreeWalk {
    uvec3 cell;  // of the deepest level
    uint level;  // of the node, from LEVELS at the root
    uint node;   // or leaf, or EMPTY
};

TreeWalk walk_from(TreeGrid grid, uint root, vec3 position) {
    vec3 place = (position - grid.low) * grid.scale;
    bool is_inside = all(greaterThanEqual(place, vec3(0.0))) && all(lessThan(place, vec3(1u << LEVELS)));
    return TreeWalk(uvec3(place), LEVELS, is_inside ? root : EMPTY);
}

// List of the records that rest at the walk's node; then moves to its child.
uint next_list(inout TreeWalk walk) {
    uint node = walk.node;
    if ((node & IS_LEAF) != 0u) {
        walk.node = EMPTY;
        return node & ~IS_LEAF;
    }
    --walk.level;
    uvec3 side = walk.cell >> walk.level & 1u;
    walk.node = word_at(TreeNodes, NODE_WORDS * node + (side.x | side.y << 1 | side.z << 2));
    return word_at(TreeNodes, NODE_WORDS * node + 8u);
}
