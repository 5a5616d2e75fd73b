// Antialiasing of a light, step 4: the mean of the light over samples of the fragments of step 2:
// over the first ones of each, or over all if the light varies much among those. Deterministic.
// LANES invocations = one fragment. In: the samples, a
// light. Out: the per-light irradiance buffer at these fragments.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/edge_places.glsl"

#define SAMPLES_OF_PIXEL

const uint LANES = 8u;  // of a fragment

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SPREAD = 0;  // float bits: variance over squared mean from which all samples are taken

struct EdgeLightPush {
    View view;
    EdgeCapacity capacity;
    uint light;
    uint first_sample;  // first sample in this dispatch; later dispatches add to the first
    uint end_sample;
    uint sample_step;   // of the lattice of the samples of all image points of a pixel
    uint flags;         // TRACES_ALL, ADDS, MARKS_PENUMBRA
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Lights;
layout(scalar, binding = 4) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 5) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 6) uniform usamplerBuffer EdgeSamples;
layout(binding = 7) uniform usamplerBuffer SampleMasks;
layout(scalar, binding = 8) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(binding = 9) uniform usamplerBuffer Fragments;
layout(scalar, binding = 10) readonly buffer ShadowGroups { uint shadow_groups[]; };
layout(scalar, binding = 11) readonly buffer MixedFragments { uint mixed_fragments[]; };
layout(scalar, binding = 12) buffer LightIrradiance { float light_irradiance[]; };
layout(scalar, binding = 13) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeLightPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/lights.glsl"
#include "include/light_kind.glsl"
#include "include/direct.glsl"

shared vec2 sums[64];

// The light at samples of a fragment, from number `first` of these on, and its square; each
// invocation takes every LANES-th. `taken` is the number of samples that are no longer in
// `members`.
vec2 sum_of_samples(Fragment fragment, uint count, uint first, uint end, inout Members members, inout uint taken) {
    View view = push.view;
    uint pixel = edge_pixels[fragment.edge];
    vec2 corner = vec2(in_rows(pixel, view.width));
    LightSource whole_light = of_kind(light_at(Lights, push.light));
    uint end_sample = end_of_kind(push.first_sample, push.end_sample);
    vec2 sum = vec2(0.0);
    for (uint k = first + gl_LocalInvocationIndex % LANES; k < end; k += LANES) {
        uint number = 0u;
        for (; taken <= k; ++taken) number = next_of(SampleMasks, members);
        PixelSurface found = seen_on(view, corner + place_in_pixel(number, pixel), word_at(EdgeSamples, fragment.edge * count + number));
        Receiver at = receiver_of(found);
        LightSource light = seen_from_point(whole_light, number, push.sample_step);
        float factor = light_factor(light, push.first_sample, end_sample, push.flags, at.position, at.normal, found.normal, found.footprint);
        factor = light.relative * weighed(light, light.samples, factor, at.position, found.normal, found.footprint);
        sum += vec2(factor, factor * factor);
    }
    return sum;
}

// The sum over the invocations of a fragment.
vec2 sum_of_lanes(vec2 own) {
    barrier();
    sums[gl_LocalInvocationIndex] = own;
    barrier();
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < LANES; ++i) sum += sums[gl_LocalInvocationIndex / LANES * LANES + i];
    return sum;
}

void main() {
    uint pixel_count = push.view.width * push.view.height;
    uint count = samples_per_edge(edge_numbers[pixel_count], push.capacity);
    uint listed = shadow_groups[11];
    uint place = flat_workgroup() * (64u / LANES) + gl_LocalInvocationIndex / LANES;
    uint index = mixed_fragments[min(place, max(listed, 1u) - 1u)];
    Fragment fragment = fragment_at(Fragments, index);
    uint own = index - fragment_firsts[fragment.edge];
    uint members = place < listed ? min(samples_of(fragment), push.capacity.light_samples) : 0u;
    Members left = members_of(SampleMasks, fragment.edge, count, own);
    uint taken = 0u;
    vec2 sum = sum_of_lanes(sum_of_samples(fragment, count, 0u, members, left, taken));
    float mean = sum.x / float(max(members, 1u));
    bool varies = sum.y / float(max(members, 1u)) - mean * mean > uintBitsToFloat(SPREAD) * mean * mean;
    uint all = varies ? samples_of(fragment) : members;
    sum += sum_of_lanes(sum_of_samples(fragment, count, members, all, left, taken));
    if (!loops_completed(push.view.width)) truncated_loops[0] = LOOP_TRUNCATED;
    if (gl_LocalInvocationIndex % LANES != 0u || place >= listed) return;
    float before = is_first(push.flags, push.first_sample) ? 0.0 : light_irradiance[pixel_count + index];
    light_irradiance[pixel_count + index] = before + sum.x / float(all);
}
