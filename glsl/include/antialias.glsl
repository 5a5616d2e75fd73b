// Pixels that show an edge are averaged over samples spread over their area; the others are what their centres see.

// What a sample of an edge pixel stands for.
struct EdgeSource {
    uint pixel;   // whose indirect irradiance it takes
    uint number;  // of the pixel's point that it shows
    float share;  // of the points that were asked for it, those that met a surface
};

// Samples of each edge pixel: as many as there is room for, if that is enough to be better than the centre alone: LEAST_SAMPLES in
// src/passes/frame/antialias.rs.
uint samples_per_edge(uint edge_count, uint most, uint capacity) {
    uint count = min(most, capacity / max(edge_count, 1u));
    return count < 4u ? 0u : count;
}
