// The fragments that a pixel shows. Include after antialias.glsl; the including shader binds
// EdgeNumbers and FragmentFirsts.

// Fragments first..end, if the pixel is an edge pixel. Any other pixel shows its centre.
struct SeenFragments {
    bool is_edge;
    uint first;
    uint end;
};

SeenFragments fragments_of(uint pixel, uint pixel_count, EdgeCapacity capacity) {
    uint edge = edge_numbers[pixel];
    if (edge == NO_EDGE || samples_per_edge(edge_numbers[pixel_count], capacity) == 0u) return SeenFragments(false, 0u, 0u);
    return SeenFragments(true, fragment_firsts[edge], fragment_firsts[edge + 1u]);
}
