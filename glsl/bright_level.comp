// Bright clusters, step 4, once for each level: the direct light of clusters that comes from bright
// ones below. Deterministic. One invocation = one listed cluster above watched ones. In: offsets of
// watched clusters, flux (W). Out: flux (W).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/hvds.glsl"
#include "include/bright.glsl"

layout(local_size_x = 64) in;

struct BrightLevelPush {
    uint first_listed;  // of the level, in the list
    uint cluster_count;
    uint base_count;    // clusters without children, which come first
};

layout(scalar, binding = 0) readonly buffer ChildOffsets { uint child_offsets[]; };  // of each cluster above the base, and the end
layout(scalar, binding = 1) readonly buffer Children { uint children[]; };
layout(scalar, binding = 2) readonly buffer AboveWatched { uint above_watched[]; };
layout(scalar, binding = 3) readonly buffer WatchedOf { uint watched_of[]; };
layout(binding = 4) uniform usamplerBuffer ClusterFluxes;
layout(scalar, binding = 5) readonly buffer BrightOffsets { uint bright_offsets[]; };
layout(scalar, binding = 6) buffer BrightFlux { vec3 bright_flux[]; };  // of each cluster above the base
layout(scalar, push_constant) uniform Push { BrightLevelPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.cluster_count) return;
    uint above = above_watched[push.first_listed + index] - push.base_count;
    vec3 sum = vec3(0.0);
    for (uint i = child_offsets[above]; i < child_offsets[above + 1u]; ++i) {
        uint child = children[i];
        uint watched = watched_of[child];
        if (watched == NOT_WATCHED) {
            if (child >= push.base_count) sum += bright_flux[child - push.base_count];
        } else if (bright_offsets[watched] != bright_offsets[watched + 1u]) {
            sum += cluster_flux_at(ClusterFluxes, child).direct;
        }
    }
    bright_flux[above] = sum;
}
