// Outgoing flux of glossy clusters by direction: π times the flux that the Phong lobes of a
// cluster's path vertices send in a direction, per unit emission of one light or of each of four.
// One dispatch handles light straight from the light, another light from surfaces. [Yue §2]
// Deterministic: the lists have a fixed order, and a light's bits are the same alone and among
// four. One invocation = one direction of one cluster. In: beams of the light at entry points, or
// contributions and outgoing flux after the first bounce. Out: W, the flux that a Lambertian
// surface of albedo 1 would have to receive.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ENTRY_POINTS = 0;  // 1: light straight from one light; 0: light from surfaces
layout(constant_id = 1) const uint LIGHTS = 1;        // 1 or 4; if 1, the buffers of the other lights are arbitrary

layout(scalar, binding = 0) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 1) readonly buffer ContributionRanges { ContributionRange contribution_ranges[]; };  // of each base cluster
layout(scalar, binding = 2) readonly buffer Contributions { Contribution contributions[]; };
layout(scalar, binding = 3) readonly buffer GlossVertices { GlossVertex gloss_vertices[]; };
layout(scalar, binding = 4) readonly buffer GlossBeams { GlossBeam gloss_beams[]; };
layout(scalar, binding = 5) readonly buffer GlossBins { GlossBin gloss_bins[]; };
layout(scalar, binding = 6) readonly buffer BaseRanges { uvec2 base_ranges[]; };   // base clusters below each cluster
layout(scalar, binding = 7) readonly buffer GlossShifts { uint gloss_shifts[]; };  // of each base cluster; NO_ENTRY: not glossy
layout(scalar, binding = 8) readonly buffer FirstBounceFlux0 { vec3 first_bounce_flux_0[]; };
layout(scalar, binding = 9) readonly buffer FirstBounceFlux1 { vec3 first_bounce_flux_1[]; };
layout(scalar, binding = 10) readonly buffer FirstBounceFlux2 { vec3 first_bounce_flux_2[]; };
layout(scalar, binding = 11) readonly buffer FirstBounceFlux3 { vec3 first_bounce_flux_3[]; };
layout(scalar, binding = 12) buffer LightBins0 { vec3 light_bins_0[]; };
layout(scalar, binding = 13) buffer LightBins1 { vec3 light_bins_1[]; };
layout(scalar, binding = 14) buffer LightBins2 { vec3 light_bins_2[]; };
layout(scalar, binding = 15) buffer LightBins3 { vec3 light_bins_3[]; };

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
    GlossFlux flux = gloss_flux_below(gloss_bin.cluster, gloss_bin.direction, push.span, hash(index, 0u));
    bool adds = push.span.adds != 0u;
    light_bins_0[index] = flux.of_light[0] + (adds ? light_bins_0[index] : vec3(0.0));
    if (LIGHTS == 1u) return;
    light_bins_1[index] = flux.of_light[1] + (adds ? light_bins_1[index] : vec3(0.0));
    light_bins_2[index] = flux.of_light[2] + (adds ? light_bins_2[index] : vec3(0.0));
    light_bins_3[index] = flux.of_light[3] + (adds ? light_bins_3[index] : vec3(0.0));
}
