// Pixels that show an edge are averaged over samples spread over their area; the others are what their centres see.

// Samples of each edge pixel: as many as there is room for, if that is enough to be better than the centre alone.
uint samples_per_edge(uint edge_count, uint most, uint capacity) {
    uint count = min(most, capacity / max(edge_count, 1u));
    return count < 4u ? 0u : count;
}
