// Light-path energy scan, first of three: segmented inclusive product over blocks of the vertex
// array. [Yue §3] Deterministic. One workgroup = one block, one invocation = a segment of its
// steps; the device determines their number. In: steps, reflectances. Out: throughput of every
// vertex of the bound buffer within its block, in cluster order; the product of each block.
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

layout(local_size_x_id = 3) in;
layout(constant_id = 0) const uint IS_GLOSSY = 0;  // 1: some steps are reflected by Phong lobes

struct PathScanPush {
    uint step_count;   // in all
    uint first_step;   // of the bound buffer of the steps
    uint first_block;  // of this dispatch
    uint end_block;
    uint first_contribution;   // of the bound buffer of the contributions
    uint end_contribution;     // its end
};

layout(binding = 0) uniform usamplerBuffer Materials;
layout(binding = 1) uniform usamplerBuffer Steps;  // three words each
layout(scalar, binding = 2) readonly buffer Lobes { float lobes[]; };  // of each step: 1 - cosα off the mirror direction
layout(scalar, binding = 3) buffer Contributions { Contribution contributions[]; };
layout(scalar, binding = 4) writeonly buffer Blocks { Segment blocks[]; };
layout(scalar, binding = 5) readonly buffer StepColours { uint step_colours[]; };  // packed; only in scenes with images
layout(scalar, push_constant) uniform Push { PathScanPush push; };

shared Segment segments[gl_WorkGroupSize.x];

// The factor of a step in the path's throughput.
vec3 factor_of(PathStep path_step, uint place) {
    if (path_step.material >= FROM_ENTRY) return vec3(path_step.weight);
    Reflectance material = reflectance_at(Materials, path_step.material);
    if (HAS_TEXTURES != 0u) material.diffuse *= unpack_colour(step_colours[place]);
    return path_step.weight * (IS_GLOSSY == 1u ? reflected_fraction(material, lobes[place]) : material.diffuse);
}

void put(uint contribution, vec3 throughput) {
    if (contribution >= push.first_contribution && contribution < push.end_contribution) contributions[contribution - push.first_contribution].throughput = throughput;
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint block = push.first_block + flat_workgroup();
    if (block >= push.end_block) return;
    uint items = BLOCK_STEPS / gl_WorkGroupSize.x;
    uint first = block * BLOCK_STEPS + thread * items;
    uint end = max(min(first + items, push.step_count), first) - push.first_step;
    first -= push.first_step;

    // From the first path start in the segment on, products are final.
    Segment running = Segment(vec3(1.0), 0u);
    for (uint i = first; i < end; ++i) {
        PathStep path_step = path_step_at(Steps, i);
        running = join(running, Segment(factor_of(path_step, i), uint(path_step.material == HEAD)));
        if (running.has_head != 0u) put(path_step.contribution, running.product);
    }
    segments[thread] = running;
    barrier();
    for (uint stride = 1u; stride < gl_WorkGroupSize.x; stride *= 2u) {
        Segment left = thread >= stride ? segments[thread - stride] : Segment(vec3(1.0), 0u);
        Segment joined = join(left, segments[thread]);
        barrier();
        segments[thread] = joined;
        barrier();
    }
    // Steps before the first path start continue the product of the invocations before.
    vec3 product = thread > 0u ? segments[thread - 1u].product : vec3(1.0);
    for (uint i = first; i < end; ++i) {
        PathStep path_step = path_step_at(Steps, i);
        if (path_step.material == HEAD) break;
        product *= factor_of(path_step, i);
        put(path_step.contribution, product);
    }
    if (thread == gl_WorkGroupSize.x - 1u) blocks[block] = segments[thread];
}
