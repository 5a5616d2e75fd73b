// Block sums, the way up of the prefix sum: sums[b] = sum of block b of the values, wrapping.
// Deterministic. One workgroup = one block of ITEMS values per invocation. In: values, their
// number. Out: one sum a block.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "include/dispatch.glsl"

layout(local_size_x_id = 3) in;
layout(constant_id = 0) const uint ITEMS = 0;

struct PrefixSumPush {
    uint count;
};

layout(set = 0, binding = 0, scalar) readonly buffer Values { uint values[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer BlockSums { uint block_sums[]; };
layout(push_constant, scalar) uniform Push { PrefixSumPush push; };

shared uint partial[gl_WorkGroupSize.x];

void main() {
    const uint thread = gl_LocalInvocationID.x;
    const uint block_first = flat_workgroup() * gl_WorkGroupSize.x * ITEMS;

    // Adjacent invocations read adjacent values: the order of an integer sum is irrelevant.
    uint sum = 0;
    for (uint item = 0; item < ITEMS; ++item) {
        const uint index = block_first + item * gl_WorkGroupSize.x + thread;
        sum += index < push.count ? values[index] : 0;
    }
    partial[thread] = sum;
    barrier();
    for (uint stride = gl_WorkGroupSize.x / 2; stride > 0; stride /= 2) {
        if (thread < stride) {
            partial[thread] += partial[thread + stride];
        }
        barrier();
    }
    if (thread == 0 && block_first < push.count) {
        block_sums[flat_workgroup()] = partial[0];
    }
}
