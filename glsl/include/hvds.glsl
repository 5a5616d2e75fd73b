// Flux that a cluster of the volumetric hierarchy has received, W.
struct ClusterFlux {
    vec3 direct;    // at entry points: straight from the lights
    vec3 indirect;  // at all other vertices: from surfaces
};
// Flux that a base cluster receives from one light, per unit of its emission and of the mean area
// of an entry point.
struct LightFlux {
    float direct;   // at entry points, in every channel
    vec3 indirect;  // at all other vertices
};

// Reads of lists that are bound as texels.
ClusterFlux cluster_flux_at(usamplerBuffer list, uint index) {
    // Six words a cluster: three texels hold two clusters.
    uint first = 3u * index >> 1;
    vec4 a = uintBitsToFloat(texelFetch(list, int(first))), b = uintBitsToFloat(texelFetch(list, int(first + 1u)));
    return (index & 1u) == 0u ? ClusterFlux(a.xyz, vec3(a.w, b.xy)) : ClusterFlux(vec3(a.zw, b.x), b.yzw);
}
LightFlux light_flux_at(usamplerBuffer list, uint index) {
    vec4 words = uintBitsToFloat(texelFetch(list, int(index)));
    return LightFlux(words.x, words.yzw);
}
