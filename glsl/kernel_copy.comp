// Copies a list: the throughput limit of kernels that move data. Deterministic. One invocation =
// four words, or one. In: words. Out: words.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 0;  // 1: a word an invocation

struct KernelCopyPush { uint count; };  // of invocations

layout(binding = 0) uniform usamplerBuffer From;
layout(scalar, binding = 1) writeonly buffer To { uvec4 to[]; };
layout(scalar, push_constant) uniform Push { KernelCopyPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.count) return;
    if (WORDS == 1u) {
        to[index >> 2][index & 3u] = word_at(From, index);
    } else {
        to[index] = texelFetch(From, int(index));
    }
}
