// Light-path energy scan, last of three: multiplies the vertices before the first path start of a
// block by the product that enters the block. Deterministic. One invocation = one block. In:
// entering products. Out: throughput of every vertex.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/path_scan.glsl"

layout(local_size_x = 64) in;

struct PathScanApplyPush {
    uint step_count;   // in all
    uint first_step;   // of the bound buffer of the steps
    uint first_block;  // of this dispatch
    uint end_block;
    uint first_contribution;   // of the bound buffer of the contributions
    uint end_contribution;     // its end
};

layout(scalar, binding = 0) readonly buffer Steps { PathStep steps[]; };
layout(scalar, binding = 1) readonly buffer Entering { vec3 entering[]; };
layout(scalar, binding = 2) buffer Contributions { Contribution contributions[]; };
layout(scalar, push_constant) uniform Push { PathScanApplyPush push; };

void main() {
    uint block = push.first_block + flat_invocation();
    if (block >= push.end_block) return;
    uint end = min((block + 1u) * BLOCK_STEPS, push.step_count) - push.first_step;
    for (uint i = block * BLOCK_STEPS - push.first_step; i < end && steps[i].material != HEAD; ++i) {
        uint contribution = steps[i].contribution;
        if (contribution < push.first_contribution || contribution >= push.end_contribution) continue;
        contributions[contribution - push.first_contribution].throughput *= entering[block];
    }
}
