// Glossy pixels, step 4: π times the light that glossy surfaces send back along the rays of a
// sample by their Phong lobes, weighted and summed, per unit emission of one light. The kernel
// skips rays that read a gloss bin. The remaining rays meet lobes that gloss bins would blur, or
// are too few to justify gloss bins. Deterministic. One invocation = one sample. In: rays, lobes of
// path vertices, beams of the light at entry points. Out: W/m².
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint HAS_ONE_BEAM = 0;  // 1: one beam at each entry point

layout(binding = 0) uniform usamplerBuffer GlossLobes;    // flux, exponent; of entry points, then of other vertices
layout(binding = 1) uniform usamplerBuffer GlossMirrors;  // unit mirror direction of each other vertex; a spare word
layout(binding = 2) uniform usamplerBuffer GlossBeams;
layout(binding = 3) uniform usamplerBuffer EntryIndices;  // into the beams, of the entry points among the vertices
layout(scalar, binding = 4) readonly buffer BaseRanges { uvec2 base_ranges[]; };        // base clusters below each cluster
layout(scalar, binding = 5) readonly buffer VertexOffsets { uvec2 vertex_offsets[]; };  // of each base cluster: (entry point, other vertex), and the end
layout(scalar, binding = 6) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 7) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 8) readonly buffer GlossRays { GlossRay gloss_rays[]; };
layout(scalar, binding = 9) readonly buffer InverseAreas { float inverse_areas[]; };  // of clusters, 1/m²
layout(scalar, binding = 10) buffer LightHits { vec3 light_hits[]; };                 // of each sample

#include "include/gloss_flux.glsl"

struct GlossHitsPush {
    GlossSpan span;
    uint pixel_count;   // of the image
    uint max_samples;  // of a pixel
    uint capacity;      // of the list of samples
    uint cluster_bits;  // width of the cluster field in GlossRay.target
};
layout(scalar, push_constant) uniform Push { GlossHitsPush push; };

void main() {
    uint index = flat_invocation();
    GlossCounts counts = gloss_counts(gloss_offsets[push.pixel_count], gloss_offsets[2u * push.pixel_count], push.max_samples, push.capacity);
    if (index >= counts.pixels.x * counts.samples.x) return;
    vec3 sum = push.span.adds != 0u ? light_hits[index] : vec3(0.0);
    for (uint i = index * LOBE_RAYS; i < (index + 1u) * LOBE_RAYS; ++i) {
        GlossRay ray = gloss_rays[i];
        if (ray.target == NO_TARGET || ray.gloss_bin != NO_GLOSS_BIN) continue;
        if (!has_lobe(materials[ray.target >> push.cluster_bits])) continue;
        uint cluster = ray.target & ((1u << push.cluster_bits) - 1u);
        GlossSpan span = push.span;
        if (span.most != 0u) span.most = vertices_for(materials[ray.target >> push.cluster_bits]);
        vec3 flux = gloss_flux_below(cluster, unpack_direction(ray.direction), span, hash(i, 1u));
        sum += ray.weight * inverse_areas[cluster] * flux;
    }
    light_hits[index] = sum;
}
