// Photon map, last step: photons in the order of their buckets, and the first entry of each bucket.
// Deterministic. One invocation = one sorted pair and one bucket. In: photons, sorted pairs. Out:
// map entries, first entries.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/tile_sort.glsl"
#include "include/photons.glsl"

layout(local_size_x = 64) in;

struct PhotonOrderPush { uint slot_count; };

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 1) readonly buffer Photons { Photon photons[]; };
layout(scalar, binding = 2) readonly buffer SortedPairs { TilePair sorted_pairs[]; };
layout(scalar, binding = 3) writeonly buffer MapEntries { MapEntry map_entries[]; };
layout(scalar, binding = 4) writeonly buffer EntryOffsets { uint entry_offsets[]; };  // one for each bucket, and the end twice
layout(scalar, push_constant) uniform Push { PhotonOrderPush push; };

#include "include/surfaces.glsl"

// Number of sorted pairs in buckets before `bucket`, by bisection: a loop over all buckets exceeds
// the iteration limit (quirks.glsl).
uint pairs_before(uint bucket) {
    uint low = 0u;
    uint high = push.slot_count;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (sorted_pairs[middle].tile < bucket) low = middle + 1u;
        else high = middle;
    }
    return low;
}

void main() {
    uint index = flat_invocation();
    if (index <= PHOTON_BUCKETS + 1u) entry_offsets[index] = pairs_before(index);
    if (index >= push.slot_count) return;
    TilePair pair = sorted_pairs[index];
    if (pair.tile == PHOTON_BUCKETS) return;
    Photon photon = photons[pair.record];
    vec3 normal = surface_at(photon.side >> 1).normal;
    map_entries[index] = MapEntry(photon.position, (photon.side & 1u) != 0u ? -normal : normal, photon.flux);
}
