// Light-path energy scan, first of three: segmented inclusive product over blocks of the vertex array. [Yue §3]
// Deterministic. One workgroup = one block. In: steps, reflectances. Out: throughput of every vertex as far as its block
// knows it, in cluster order, as far as it is bound; each block's own product.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/path_scan.glsl"
#include "include/colour.glsl"

layout(local_size_x = 256) in;
layout(constant_id = 0) const uint SHINES = 0;  // 1: some steps are reflected by Phong lobes

struct PathScanPush {
    uint step_count;   // in all
    uint first_step;   // of the bound part of the steps
    uint first_block;  // of this dispatch
    uint end_block;
    uint first_slot;   // of the bound part of the deposits
    uint end_slot;     // its end
};

layout(binding = 0) uniform usamplerBuffer Materials;
layout(scalar, binding = 1) readonly buffer Steps { PathStep steps[]; };
layout(scalar, binding = 2) readonly buffer Lobes { float lobes[]; };  // of each step: 1 - cosα off the mirror direction
layout(scalar, binding = 3) buffer Deposits { Deposit deposits[]; };
layout(scalar, binding = 4) writeonly buffer Blocks { Segment blocks[]; };
layout(scalar, binding = 5) readonly buffer StepColours { uint step_colours[]; };  // packed; only in scenes with images
layout(scalar, push_constant) uniform Push { PathScanPush push; };

shared Segment segments[BLOCK_THREADS];

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint block = push.first_block + flat_workgroup();
    if (block >= push.end_block) return;
    uint first = block * BLOCK_STEPS + thread * BLOCK_ITEMS;
    Segment scanned[BLOCK_ITEMS];
    Segment running = Segment(vec3(1.0), 0u);
    for (uint i = 0u; i < BLOCK_ITEMS; ++i) {
        if (first + i < push.step_count) {
            PathStep path_step = steps[first + i - push.first_step];
            bool head = path_step.material == HEAD;
            vec3 factor = vec3(path_step.weight);
            if (path_step.material < FROM_ENTRY) {
                Reflectance material = reflectance_at(Materials, path_step.material);
                if (HAS_TEXTURES != 0u) material.diffuse *= unpack_colour(step_colours[first + i - push.first_step]);
                factor *= SHINES == 1u ? reflected_share(material, lobes[first + i - push.first_step]) : material.diffuse;
            }
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
        uint slot = steps[first + i - push.first_step].slot;
        if (slot < push.first_slot || slot >= push.end_slot) continue;
        deposits[slot - push.first_slot].throughput = join(before, scanned[i]).product;
    }
    if (thread == BLOCK_THREADS - 1u) blocks[block] = segments[thread];
}
