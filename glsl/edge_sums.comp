// Antialiasing of a light, step 1: sums its light at the samples of an edge pixel, slot by slot,
// and derives the number of samples from their variance. Deterministic. One invocation = one edge
// pixel. In: samples, their light. Out: the per-light irradiance buffer at the pixel's slots; the
// number of samples that the pixel needs, 0 if the present ones suffice.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SPREAD = 0;  // float bits: variance over squared mean from which a pixel takes more samples
layout(constant_id = 1) const uint DENSITY = 0; // samples of such a pixel over that ratio
layout(constant_id = 2) const uint MAX_SAMPLE_FACTOR = 0;    // upper bound, over the samples that every edge pixel has

struct EdgeListPush {
    uint width;
    uint pixel_count;
    EdgeCapacity capacity;
};

layout(scalar, binding = 0) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(binding = 1) uniform usamplerBuffer EdgeSamples;
layout(binding = 2) uniform usamplerBuffer EdgeLight;
layout(scalar, binding = 3) buffer LightIrradiance { float light_irradiance[]; };
layout(scalar, binding = 4) writeonly buffer EdgeNeeds { uint edge_needs[]; };
layout(scalar, binding = 5) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, push_constant) uniform Push { EdgeListPush push; };

void main() {
    uint edge_count = edge_numbers[push.pixel_count];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint slots_each = slots_per_edge(edge_count, push.capacity);
    uint edge = flat_invocation();
    if (edge >= edge_count) return;
    vec4 sums = vec4(0.0);
    float squares = 0.0;
    bool is_covered = true;
    for (uint i = edge * count; i < (edge + 1u) * count; ++i) {
        float light = uintBitsToFloat(word_at(EdgeLight, i));
        EdgeSample found = edge_sample_of(pair_at(EdgeSamples, i));
        sums += mix(vec4(0.0), vec4(light), equal(uvec4(0u, 1u, 2u, 3u), uvec4(slot_of(found))));
        squares += light * light;
        is_covered = is_covered && eighths_of(found) == 8u;
    }
    for (uint i = 0u; i < slots_each && count > 0u; ++i) light_irradiance[push.pixel_count + edge * slots_each + i] = sums[i] / float(count);
    // Along the scene's outline each sample has traced several image points already.
    float mean = (sums.x + sums.y + sums.z + sums.w) / float(max(count, 1u));
    float variance = squares / float(max(count, 1u)) - mean * mean;
    float spread = mean > 0.0 && is_covered ? variance / (mean * mean) : 0.0;
    uint need = min(uint(float(DENSITY) * spread), MAX_SAMPLE_FACTOR * count) & ~15u;
    // Without the mark of a penumbra: all edge pixels have samples.
    light_irradiance[edge_pixels[edge]] = abs(light_irradiance[edge_pixels[edge]]);
    edge_needs[edge] = spread < uintBitsToFloat(SPREAD) || need <= count ? 0u : need;
}
