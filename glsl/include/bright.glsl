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

// Sums over some watched clusters.
struct BrightSum {
    float light;   // direct light that they reflect, W
    float area;    // m²
    float square;  // sum of light² / area
};

// A bright cluster. Rays select it in proportion to its weight.
struct BrightCluster {
    uint cluster;
    uint end;  // sum of the weights up to its own
};

// What the select step has found.
struct BrightState {
    uint count;   // bright clusters; 0: gather rays bring all light
    uint weight;  // of all of them
};

// Weights in units of all direct light that surfaces reflect: the sum of a scene's weights is at
// most that, and one for each cluster by rounding.
const uint ALL_LIGHT = 1u << 30;

// Invocations that cast the rays of one record.
const uint BRIGHT_LANES = 4u;

// Mean of the channels.
float brightness(vec3 colour) { return (colour.x + colour.y + colour.z) / 3.0; }
