// Bright clusters, step 3: the weight of each watched cluster, in proportion to the direct light
// that it reflects if it is bright, else zero. Deterministic. One invocation = one watched cluster.
// In: flux of clusters (W), state. Out: weights.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/hvds.glsl"
#include "include/bright.glsl"

layout(local_size_x = 64) in;

struct BrightWeightsPush {
    uint watched_count;
    float contrast;      // least radiant exitance of a bright cluster, over the mean
};

layout(scalar, binding = 0) readonly buffer WatchedClusters { Watched watched_clusters[]; };
layout(binding = 1) uniform usamplerBuffer Materials;
layout(binding = 2) uniform usamplerBuffer ClusterFluxes;
layout(scalar, binding = 3) readonly buffer InverseAreas { float inverse_areas[]; };  // 1/m²
layout(scalar, binding = 4) readonly buffer BrightStates { BrightState bright_state[]; };
layout(scalar, binding = 5) writeonly buffer BrightOffsets { uint bright_offsets[]; };  // weights; a prefix sum follows
layout(scalar, push_constant) uniform Push { BrightWeightsPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.watched_count) return;
    BrightState state = bright_state[0];
    Watched watched = watched_clusters[index];
    vec3 flux = cluster_flux_at(ClusterFluxes, watched.cluster).direct;
    float reflected = brightness(reflectance_at(Materials, watched.material).diffuse * flux);
    bool is_bright = reflected * inverse_areas[watched.cluster] * state.area > push.contrast * state.light;
    // Rounded up, so that each bright cluster has a chance.
    float weight = ceil(min(reflected / state.light, 1.0) * float(ALL_LIGHT));
    bright_offsets[index] = is_bright ? uint(weight) : 0u;
}
