// Light-path energy scan, second of three: exclusive segmented product over the blocks.
// Deterministic. One workgroup in all. In: each block's product. Out: the product that enters each
// block from the left.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/path_scan.glsl"

layout(local_size_x_id = 3) in;

struct PathScanCarryPush { uint block_count; };

layout(scalar, binding = 0) readonly buffer Blocks { Segment blocks[]; };
layout(scalar, binding = 1) writeonly buffer Entering { vec3 entering[]; };
layout(scalar, push_constant) uniform Push { PathScanCarryPush push; };

shared Segment segments[gl_WorkGroupSize.x];

void main() {
    uint thread = gl_LocalInvocationIndex;
    Segment carry = Segment(vec3(1.0), 0u);
    for (uint base = 0u; base < push.block_count; base += gl_WorkGroupSize.x) {
        uint index = base + thread;
        segments[thread] = index < push.block_count ? blocks[index] : Segment(vec3(1.0), 0u);
        barrier();
        for (uint stride = 1u; stride < gl_WorkGroupSize.x; stride *= 2u) {
            Segment left = thread >= stride ? segments[thread - stride] : Segment(vec3(1.0), 0u);
            Segment joined = join(left, segments[thread]);
            barrier();
            segments[thread] = joined;
            barrier();
        }
        Segment before = thread > 0u ? join(carry, segments[thread - 1u]) : carry;
        carry = join(carry, segments[gl_WorkGroupSize.x - 1u]);
        if (index < push.block_count) entering[index] = before.product;
        barrier();
    }
}
