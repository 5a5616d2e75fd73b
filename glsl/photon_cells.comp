// Photon map, first step: the bucket of each photon's cell, for the sort. Deterministic. One
// invocation = one slot. In: photons. Out: (bucket, slot) pairs; empty slots fall into the bucket
// behind the last.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/tile_sort.glsl"
#include "include/photons.glsl"

layout(local_size_x = 64) in;

struct PhotonCellsPush {
    PhotonGrid grid;
    uint slot_count;
};

layout(scalar, binding = 0) readonly buffer Photons { Photon photons[]; };
layout(scalar, binding = 1) writeonly buffer Pairs { TilePair pairs[]; };
layout(scalar, push_constant) uniform Push { PhotonCellsPush push; };

void main() {
    uint slot = flat_invocation();
    if (slot >= push.slot_count) return;
    Photon photon = photons[slot];
    bool is_empty = photon.side == NO_SIDE;
    pairs[slot] = TilePair(is_empty ? PHOTON_BUCKETS : photon_bucket(photon_cell(push.grid, photon.position)), slot);
}
