// Pixels that show an edge are averaged over samples spread over their area; the others are what their centres see.

// One sample of such a pixel.
struct EdgeSample {
    vec3 direct;  // irradiance, W/m²
    uint side;    // 2·triangle + (1 if the back side); NO_SIDE where the ray left the scene
    uint source;  // the pixel whose indirect irradiance it takes
};

// Samples of each edge pixel: as many as there is room for, if that is enough to be better than the centre alone.
uint samples_per_edge(uint edge_count, uint most, uint capacity) {
    uint count = min(most, capacity / max(edge_count, 1u));
    return count < 4u ? 0u : count;
}
