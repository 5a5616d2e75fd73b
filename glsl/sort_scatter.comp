// Stable radix sort of (tile, record) pairs, scatter step: moves each pair behind the pairs with
// smaller digits and the earlier pairs with its digit. Deterministic. One workgroup = one block of
// 256 pairs. In: pairs, digit offsets. Out: sorted pairs.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/tile_sort.glsl"

layout(local_size_x = 256) in;


layout(scalar, binding = 0) readonly buffer PairOffsets { uint pair_offsets[]; };
layout(scalar, binding = 1) readonly buffer Pairs { TilePair pairs[]; };
layout(scalar, binding = 2) readonly buffer DigitOffsets { uint digit_offsets[]; };  // digit-major
layout(scalar, binding = 3) writeonly buffer SortedPairs { TilePair sorted_pairs[]; };
layout(scalar, push_constant) uniform Push { SortPush push; };

shared uint digits[256];

void main() {
    uint block = flat_workgroup();
    if (block >= push.block_count) return;
    uint thread = gl_LocalInvocationIndex;
    uint index = block * 256u + thread;
    bool exists = index < min(pair_offsets[push.record_count], push.block_count * 256u);
    TilePair pair = exists ? pairs[index] : TilePair(0u, 0u);
    uint digit = exists ? (pair.tile >> push.shift) & 0xffu : 256u;
    digits[thread] = digit;
    barrier();
    if (!exists) return;
    uint rank = 0u;
    for (uint i = 0u; i < thread; ++i) rank += uint(digits[i] == digit);
    sorted_pairs[digit_offsets[digit * push.block_count + block] + rank] = pair;
}
