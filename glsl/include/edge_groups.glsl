// Sizes of dispatches over edge pixels and fragments, as in src/passes/frame/antialias.rs. Include
// after dispatch.glsl and indirect.glsl. The including shader binds `uint edge_groups[]`.

void put_groups(uint first, uint groups) {
    for (uint axis = 0u; axis < 3u; ++axis) edge_groups[first + axis] = swizzled(groups)[axis];
}

// The number of fragments; workgroups of 64 of them, and of `group_points` values of light (pixels
// and fragments).
void put_fragments(uint pixel_count, uint fragments, uint group_points) {
    put_groups(12u, (pixel_count + fragments + group_points - 1u) / group_points);
    put_groups(16u, (fragments + 63u) / 64u);
    edge_groups[19] = fragments;
}
