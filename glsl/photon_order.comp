// Photon map, last step: photons in the order of their buckets, and where each bucket begins. Deterministic.
// One invocation = one sorted pair, and one more for the end. In: photons, sorted pairs. Out: map entries, first entries.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/splat.glsl"
#include "include/photons.glsl"

layout(local_size_x = 64) in;

struct PhotonOrderPush { uint slot_count; };

layout(scalar, binding = 0) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 1) readonly buffer Photons { Photon photons[]; };
layout(scalar, binding = 2) readonly buffer SortedPairs { TilePair sorted_pairs[]; };
layout(scalar, binding = 3) writeonly buffer MapEntries { MapEntry map_entries[]; };
layout(scalar, binding = 4) writeonly buffer FirstEntries { uint first_entries[]; };  // a bucket, and the end twice
layout(scalar, push_constant) uniform Push { PhotonOrderPush push; };

void main() {
    uint index = flat_invocation();
    if (index > push.slot_count) return;
    uint bucket = index < push.slot_count ? sorted_pairs[index].tile : PHOTON_BUCKETS + 1u;
    uint before = index > 0u ? sorted_pairs[index - 1u].tile + 1u : 0u;
    // All buckets after the last pair's, up to this one's, begin here.
    for (uint b = before; b <= bucket; ++b) first_entries[b] = index;
    if (bucket >= PHOTON_BUCKETS) return;
    Photon photon = photons[sorted_pairs[index].record];
    vec3 normal = surfaces[photon.side >> 1].normal;
    map_entries[index] = MapEntry(photon.position, (photon.side & 1u) != 0u ? -normal : normal, photon.flux);
}
