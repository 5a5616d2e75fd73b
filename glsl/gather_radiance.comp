// Final gathering, step 1: radiance that a gather target sends back along its rays, computed
// once for all of them. A gather target is a cluster with a material, or a cell of the sky.
// [Yue §3] Deterministic. One invocation = one gather target. In: cluster irradiance (W/m²), flux
// of gloss bins (W), reflectances, radiance of the sky (W/m²/sr). Out: W/m²/sr.
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
#include "include/colour.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint IS_GLOSSY = 0;  // 1: cluster fields beyond cluster_count are gloss bins

struct GatherRadiancePush {
    uint target_count;
    uint cluster_bits;   // width of the cluster field in a target
    uint cluster_count;  // near-field patches included
    uint first_sky;      // number of the target of the sky's first cell
    uint has_sky;        // 0: the sky is black
};

layout(scalar, binding = 0) readonly buffer Targets { uint targets[]; };  // targets of gather rays, in ascending order
layout(binding = 1) uniform usamplerBuffer Materials;
layout(binding = 2) uniform usamplerBuffer Irradiance;  // three floats each
layout(scalar, binding = 3) readonly buffer InverseAreas { float inverse_areas[]; };  // of clusters, 1/m²
layout(scalar, binding = 4) readonly buffer GlossBins { GlossBin gloss_bins[]; };
layout(scalar, binding = 5) readonly buffer GlossFluxes { vec3 gloss_fluxes[]; };     // of gloss bins, W
layout(scalar, binding = 6) writeonly buffer Radiances { vec4 radiances[]; };  // radiance, in scenes with images the diffuse part without their colour; whether it is the sky's; texels
layout(scalar, binding = 7) writeonly buffer LobeRadiances { vec3 lobe_radiances[]; };        // of Phong lobes; only in scenes with images
layout(scalar, binding = 8) readonly buffer SkyRadiance { vec3 sky_radiance[]; };
layout(scalar, push_constant) uniform Push { GatherRadiancePush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.target_count) return;
    uint target = targets[index];
    uint cluster = target & ((1u << push.cluster_bits) - 1u);
    if (cluster >= push.first_sky) {
        if (IS_GLOSSY == 1u && HAS_TEXTURES != 0u) lobe_radiances[index] = vec3(0.0);
        radiances[index] = vec4(push.has_sky != 0u ? sky_radiance[cluster - push.first_sky] : vec3(0.0), IS_SKY_CELL);
        return;
    }
    vec3 gloss = vec3(0.0);
    if (IS_GLOSSY == 1u && cluster >= push.cluster_count) {
        uint gloss_bin = cluster - push.cluster_count;
        cluster = gloss_bins[gloss_bin].cluster;
        gloss = gloss_fluxes[gloss_bin] * inverse_areas[cluster] * (1.0 / PI);
    }
    vec3 radiance = reflectance_at(Materials, target >> push.cluster_bits).diffuse * uintBitsToFloat(triple_at(Irradiance, cluster)) * (1.0 / PI);
    // Images colour the diffuse part alone.
    if (HAS_TEXTURES == 0u) radiance += gloss;
    else if (IS_GLOSSY == 1u) lobe_radiances[index] = gloss;
    radiances[index] = vec4(radiance, 0.0);
}
