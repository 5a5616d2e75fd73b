// Light-path energy scan, first of three: segmented inclusive product over blocks of the vertex array. [Yue §3]
// Deterministic. One workgroup = one block. In: steps, reflectances. Out: throughput of every vertex as far as its block
// knows it, in cluster order; each block's own product.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/path_scan.glsl"
#include "include/colour.glsl"

layout(local_size_x = 256) in;

struct PathScanPush { uint step_count; };

layout(scalar, binding = 0) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 1) readonly buffer Steps { PathStep steps[]; };
layout(scalar, binding = 2) buffer Deposits { Deposit deposits[]; };
layout(scalar, binding = 3) writeonly buffer Blocks { Segment blocks[]; };
layout(scalar, binding = 4) readonly buffer StepColours { uint step_colours[]; };  // packed; only in scenes with images
layout(scalar, push_constant) uniform Push { PathScanPush push; };

shared Segment segments[BLOCK_THREADS];

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint first = flat_workgroup() * BLOCK_STEPS + thread * BLOCK_ITEMS;
    Segment scanned[BLOCK_ITEMS];
    Segment running = Segment(vec3(1.0), 0u);
    for (uint i = 0u; i < BLOCK_ITEMS; ++i) {
        if (first + i < push.step_count) {
            PathStep path_step = steps[first + i];
            bool head = path_step.material == HEAD;
            vec3 factor = (head ? vec3(1.0) : materials[path_step.material].diffuse) * path_step.weight;
            if (HAS_TEXTURES != 0u) factor *= unpack_colour(step_colours[first + i]);
            running = join(running, Segment(factor, uint(head)));
        }
        scanned[i] = running;
    }
    segments[thread] = running;
    barrier();
    for (uint stride = 1u; stride < BLOCK_THREADS; stride *= 2u) {
        Segment left = thread >= stride ? segments[thread - stride] : Segment(vec3(1.0), 0u);
        Segment joined = join(left, segments[thread]);
        barrier();
        segments[thread] = joined;
        barrier();
    }
    Segment before = thread > 0u ? segments[thread - 1u] : Segment(vec3(1.0), 0u);
    for (uint i = 0u; i < BLOCK_ITEMS && first + i < push.step_count; ++i) {
        deposits[steps[first + i].slot].throughput = join(before, scanned[i]).product;
    }
    if (thread == BLOCK_THREADS - 1u) blocks[flat_workgroup()] = segments[thread];
}
