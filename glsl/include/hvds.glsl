// What a cluster of the volumetric hierarchy has received, W.
struct ClusterFlux {
    vec3 direct;    // at entry points: straight from the lights
    vec3 indirect;  // at all other vertices: from surfaces
};
