// Exclusive prefix sum of each block in place, the way down: values[i] = block offset + sum of the
// block's values before i. Deterministic. One workgroup = one block of ITEMS values per invocation.
// In: values, their number, the offset of each block. Out: values, and the total at values[count].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "include/dispatch.glsl"

layout(local_size_x_id = 3) in;
layout(constant_id = 0) const uint ITEMS = 0;

struct PrefixSumPush {
    uint count;
};

layout(set = 0, binding = 0, scalar) buffer Values { uint values[]; };
layout(set = 0, binding = 1, scalar) readonly buffer BlockOffsets { uint block_offsets[]; };
layout(push_constant, scalar) uniform Push { PrefixSumPush push; };

shared uint partial[gl_WorkGroupSize.x];

void main() {
    const uint thread = gl_LocalInvocationID.x;
    const uint block = flat_workgroup();
    const uint block_length = gl_WorkGroupSize.x * ITEMS;
    // A workgroup without values returns as a whole, except the first one: it writes the total of
    // an empty list.
    if (block > 0 && block * block_length >= push.count) {
        return;
    }
    const uint first = min(block * block_length + thread * ITEMS, push.count);
    const uint end = min(first + ITEMS, push.count);

    // The sum of this invocation's segment, then an inclusive prefix sum over the workgroup.
    uint sum = 0;
    for (uint index = first; index < end; ++index) {
        sum += values[index];
    }
    partial[thread] = sum;
    barrier();
    for (uint stride = 1; stride < gl_WorkGroupSize.x; stride *= 2) {
        const uint before = thread >= stride ? partial[thread - stride] : 0;
        barrier();
        partial[thread] += before;
        barrier();
    }

    // The sum of all values before this invocation's segment.
    uint running = block_offsets[block] + partial[thread] - sum;
    for (uint index = first; index < end; ++index) {
        const uint value = values[index];
        values[index] = running;
        running += value;
    }
    // The last invocation of the last block writes the total.
    if (thread == gl_WorkGroupSize.x - 1 && (block + 1) * block_length >= push.count) {
        values[push.count] = running;
    }
}
