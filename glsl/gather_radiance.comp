// Final gathering, step 1: radiance that a gather target sends back along its rays, computed
// once for all of them. A gather target is a cluster with a material, or a cell of the sky.
// [Yue §3] Deterministic. One invocation = one gather target. In: cluster irradiance (W/m²), flux
// of gloss bins (W), reflectances, radiance of the sky (W/m²/sr). Out: W/m²/sr; the size of the
// dispatch of bright_rays.comp.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/colour.glsl"
#include "include/hvds.glsl"
#include "include/bright.glsl"
#include "include/indirect.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint IS_GLOSSY = 0;  // 1: cluster fields beyond cluster_count are gloss bins

struct GatherRadiancePush {
    uint target_count;
    uint cluster_bits;   // width of the number in a target
    uint cluster_count;  // near-field patches included
    uint record_count;   // of all, listed or not; 0: bright clusters are not sampled apart
    uint first_sky;      // number of the target of the sky's first cell
    uint has_sky;        // 0: the sky is black
};

layout(scalar, binding = 0) readonly buffer Targets { uint targets[]; };  // targets of gather rays, in ascending order
layout(binding = 1) uniform usamplerBuffer Materials;
layout(binding = 2) uniform usamplerBuffer Irradiance;  // three floats each
layout(scalar, binding = 3) readonly buffer InverseAreas { float inverse_areas[]; };  // of clusters, 1/m²
layout(scalar, binding = 4) readonly buffer GlossBins { GlossBin gloss_bins[]; };
layout(scalar, binding = 5) readonly buffer GlossFluxes { vec3 gloss_fluxes[]; };     // of gloss bins, W
layout(scalar, binding = 6) writeonly buffer Radiances { vec4 radiances[]; };  // all radiance, in scenes with images the diffuse part without their colour; whether it is the sky's; texels; only in glossy scenes
layout(scalar, binding = 7) writeonly buffer LobeRadiances { vec3 lobe_radiances[]; };        // of Phong lobes; only in scenes with images
layout(scalar, binding = 8) readonly buffer SkyRadiance { vec3 sky_radiance[]; };
layout(binding = 9) uniform usamplerBuffer ClusterFluxes;
layout(scalar, binding = 10) readonly buffer WatchedRanges { uvec2 watched_ranges[]; };  // of each cluster: the watched clusters in it, or the one around it
layout(scalar, binding = 11) readonly buffer BrightRanks { uint bright_ranks[]; };  // bright clusters before each watched one, and their number
layout(scalar, binding = 12) readonly buffer BrightClusters { BrightCluster bright_clusters[]; };
layout(scalar, binding = 13) readonly buffer BrightStates { BrightState bright_state[]; };
layout(scalar, binding = 14) readonly buffer RecordOffsets { uint record_offsets[]; };  // exclusive prefix sum over the records, and the total
layout(scalar, binding = 15) writeonly buffer BrightGroups { uint bright_groups[]; };  // workgroups of bright_rays.comp
layout(scalar, binding = 16) writeonly buffer GatheredRadiances { vec4 gathered_radiances[]; };  // the same for gather rays: without the light of bright clusters that are far away
layout(scalar, push_constant) uniform Push { GatherRadiancePush push; };

// The part of a cluster's irradiance that bright_rays.comp samples.
vec3 bright_irradiance(uint cluster) {
    uvec2 watched = watched_ranges[cluster];
    uint first = bright_ranks[watched.x], end = bright_ranks[watched.y];
    vec3 flux = vec3(0.0);
    // Of one watched cluster, around it or of the same light.
    if (watched.y == watched.x + 1u) {
        if (first != end) flux = cluster_flux_at(ClusterFluxes, cluster).direct;
    } else {
        for (uint number = first; number < end; ++number) flux += cluster_flux_at(ClusterFluxes, bright_clusters[number].cluster).direct;
    }
    return flux * inverse_areas[cluster];
}

void main() {
    uint index = flat_invocation();
    bool has_bright = push.record_count != 0u && bright_state[0].count != 0u;
    if (index == 0u && push.record_count != 0u) {
        // BRIGHT_LANES invocations for each listed record.
        uint groups = has_bright ? (record_offsets[push.record_count] * BRIGHT_LANES + 63u) / 64u : 0u;
        for (uint axis = 0u; axis < 3u; ++axis) bright_groups[axis] = swizzled(groups)[axis];
    }
    if (index >= push.target_count) return;
    uint target = targets[index];
    uint cluster = target & ((1u << push.cluster_bits) - 1u);
    if (cluster >= push.first_sky) {
        if (IS_GLOSSY == 1u && HAS_TEXTURES != 0u) lobe_radiances[index] = vec3(0.0);
        vec4 sky = vec4(push.has_sky != 0u ? sky_radiance[cluster - push.first_sky] : vec3(0.0), IS_SKY_CELL);
        gathered_radiances[index] = sky;
        if (IS_GLOSSY == 1u) radiances[index] = sky;
        return;
    }
    vec3 gloss = vec3(0.0);
    if (IS_GLOSSY == 1u && cluster >= push.cluster_count) {
        uint gloss_bin = cluster - push.cluster_count;
        cluster = gloss_bins[gloss_bin].cluster;
        gloss = gloss_fluxes[gloss_bin] * inverse_areas[cluster] * (1.0 / PI);
    }
    uint met = target >> push.cluster_bits;  // 2·material + (1 if far away)
    vec3 reflected = reflectance_at(Materials, met >> 1).diffuse * (1.0 / PI);
    vec3 radiance = reflected * uintBitsToFloat(triple_at(Irradiance, cluster));
    vec3 apart = vec3(0.0);
    if_any (has_bright && (met & 1u) != 0u) apart = reflected * bright_irradiance(cluster);
    // Images colour the diffuse part alone.
    if (HAS_TEXTURES == 0u) radiance += gloss;
    else if (IS_GLOSSY == 1u) lobe_radiances[index] = gloss;
    // Below zero only by rounding.
    gathered_radiances[index] = vec4(max(radiance - apart, vec3(0.0)), 0.0);
    if (IS_GLOSSY == 1u) radiances[index] = vec4(radiance, 0.0);
}
