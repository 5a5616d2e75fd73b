// Outgoing flux of glossy clusters by direction: π times the flux that the Phong lobes of a
// cluster's path vertices send in a direction, per unit emission of one light. [Yue §2]
// Deterministic: the lists have a fixed order. One invocation = one direction of one cluster. In:
// lobes of path vertices, beams of the light at entry points. Out: W, the flux that a Lambertian
// surface of albedo 1 would have to receive.
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

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint HAS_ONE_BEAM = 0;  // 1: one beam at each entry point

layout(binding = 0) uniform usamplerBuffer GlossLobes;    // flux, exponent; of entry points, then of other vertices
layout(binding = 1) uniform usamplerBuffer GlossMirrors;  // unit mirror direction of each other vertex; a spare word
layout(binding = 2) uniform usamplerBuffer GlossBeams;
layout(binding = 3) uniform usamplerBuffer EntryIndices;  // into the beams, of the entry points among the vertices
layout(scalar, binding = 4) readonly buffer BaseRanges { uvec2 base_ranges[]; };        // base clusters below each cluster
layout(scalar, binding = 5) readonly buffer VertexOffsets { uvec2 vertex_offsets[]; };  // of each base cluster: (entry point, other vertex), and the end
layout(scalar, binding = 6) readonly buffer GlossBins { GlossBin gloss_bins[]; };
layout(scalar, binding = 7) buffer LightBins { vec3 light_bins[]; };

#include "include/gloss_flux.glsl"

struct GlossBasePush {
    GlossSpan span;
    uint bin_count;  // the first gloss bins, which are no sums of other gloss bins
};
layout(scalar, push_constant) uniform Push { GlossBasePush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.bin_count) return;
    GlossBin gloss_bin = gloss_bins[index];
    vec3 flux = gloss_flux_below(gloss_bin.cluster, gloss_bin.direction, push.span, hash(index, 0u));
    light_bins[index] = flux + (push.span.adds != 0u ? light_bins[index] : vec3(0.0));
}
