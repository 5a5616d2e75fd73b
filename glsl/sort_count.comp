// Stable radix sort of (tile, record) pairs, counting step: counts each digit in each block of 256
// pairs. Deterministic (integer counts). One workgroup = one block. In: pairs. Out: digit counts.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/tile_sort.glsl"

layout(local_size_x = 256) in;


layout(scalar, binding = 0) readonly buffer PairOffsets { uint pair_offsets[]; };
layout(scalar, binding = 1) readonly buffer Pairs { TilePair pairs[]; };
layout(scalar, binding = 2) writeonly buffer DigitCounts { uint digit_counts[]; };  // digit-major
layout(scalar, push_constant) uniform Push { SortPush push; };

shared uint counts[256];

void main() {
    uint block = flat_workgroup();
    if (block >= push.block_count) return;
    uint thread = gl_LocalInvocationIndex;
    counts[thread] = 0u;
    barrier();
    uint index = block * 256u + thread;
    if (index < pair_offsets[push.record_count]) atomicAdd(counts[(pairs[index].tile >> push.shift) & 0xffu], 1u);
    barrier();
    digit_counts[thread * push.block_count + block] = counts[thread];
}
