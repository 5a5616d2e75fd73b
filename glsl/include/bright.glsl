// Bright clusters reflect far more direct light than the mean. So few gather rays meet them that
// records sample them by rays of their own (bright_rays.comp). They are some of the *watched*
// clusters: a few base cells wide, none inside another, they hold all entry points.

// A point of a base cluster, in its middle.
struct BrightSite {
    vec3 position;
    uint side;    // 2·triangle + (1 if the back side)
    float reach;  // metres; longer gather rays leave the cluster's light out if it is bright
};

// A watched cluster.
struct Watched {
    uint cluster;
    uint material;  // of most of its entry points
};

// Sums over the watched clusters, and what follows from them.
struct BrightState {
    float light;   // direct light that they reflect, W
    float area;    // m²
    float square;  // sum of light² / area
    uint is_on;    // 1: some clusters may be bright
};

// A cluster that belongs to no watched one.
const uint NOT_WATCHED = 0xffffffffu;
// Weights in units of all direct light that surfaces reflect: the sum of a scene's weights is at
// most that, and one for each cluster by rounding.
const uint ALL_LIGHT = 1u << 30;

// Mean of the channels.
float brightness(vec3 colour) { return (colour.x + colour.y + colour.z) / 3.0; }
