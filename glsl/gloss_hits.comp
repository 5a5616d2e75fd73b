// Glossy pixels, step 4: π times the light that glossy surfaces send back along the rays of a
// sample by their Phong lobes, weighted and summed. Per unit emission of one light or of each of
// four; one dispatch handles light straight from the light, another light from surfaces. The kernel
// skips rays that read a gloss bin. The remaining rays meet lobes that gloss bins would blur, or
// are too few to justify gloss bins. Deterministic. One invocation = one sample. In: rays, beams of
// a light, or contributions and outgoing flux after the first bounce. Out: W/m².
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ENTRY_POINTS = 0;  // 1: light straight from one light; 0: light from surfaces
layout(constant_id = 1) const uint LIGHTS = 1;        // 1 or 4; if 1, the buffers of the other lights are arbitrary

layout(scalar, binding = 0) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 1) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 2) readonly buffer GlossRays { GlossRay gloss_rays[]; };
layout(scalar, binding = 3) readonly buffer InverseAreas { float inverse_areas[]; };  // of clusters, 1/m²
layout(scalar, binding = 4) readonly buffer BaseRanges { uvec2 base_ranges[]; };      // base clusters below each cluster
layout(scalar, binding = 5) readonly buffer GlossShifts { uint gloss_shifts[]; };     // of each base cluster; NO_ENTRY: not glossy
layout(scalar, binding = 6) readonly buffer ContributionRanges { ContributionRange contribution_ranges[]; };  // of each base cluster
layout(scalar, binding = 7) readonly buffer Contributions { Contribution contributions[]; };
layout(scalar, binding = 8) readonly buffer GlossVertices { GlossVertex gloss_vertices[]; };
layout(scalar, binding = 9) readonly buffer GlossBeams { GlossBeam gloss_beams[]; };
layout(scalar, binding = 10) readonly buffer FirstBounceFlux0 { vec3 first_bounce_flux_0[]; };
layout(scalar, binding = 11) readonly buffer FirstBounceFlux1 { vec3 first_bounce_flux_1[]; };
layout(scalar, binding = 12) readonly buffer FirstBounceFlux2 { vec3 first_bounce_flux_2[]; };
layout(scalar, binding = 13) readonly buffer FirstBounceFlux3 { vec3 first_bounce_flux_3[]; };
layout(scalar, binding = 14) buffer LightHits0 { vec3 light_hits_0[]; };  // of each sample
layout(scalar, binding = 15) buffer LightHits1 { vec3 light_hits_1[]; };
layout(scalar, binding = 16) buffer LightHits2 { vec3 light_hits_2[]; };
layout(scalar, binding = 17) buffer LightHits3 { vec3 light_hits_3[]; };

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
    uint count = gloss_offsets[push.pixel_count];
    if (index >= count * gloss_samples_per_pixel(count, push.max_samples, push.capacity)) return;
    GlossFlux sum = GlossFlux(vec3[4](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)));
    if (push.span.adds != 0u) {
        sum.of_light[0] = light_hits_0[index];
        if (LIGHTS == 4u) {
            sum.of_light[1] = light_hits_1[index];
            sum.of_light[2] = light_hits_2[index];
            sum.of_light[3] = light_hits_3[index];
        }
    }
    for (uint i = index * LOBE_RAYS; i < (index + 1u) * LOBE_RAYS; ++i) {
        GlossRay ray = gloss_rays[i];
        if (ray.target == NO_TARGET || ray.gloss_bin != NO_GLOSS_BIN) continue;
        if (!has_lobe(materials[ray.target >> push.cluster_bits])) continue;
        uint cluster = ray.target & ((1u << push.cluster_bits) - 1u);
        GlossSpan span = push.span;
        if (span.most != 0u) span.most = vertices_for(materials[ray.target >> push.cluster_bits]);
        GlossFlux flux = gloss_flux_below(cluster, unpack_direction(ray.direction), span, hash(i, 1u));
        vec3 weight = vec3(ray.weight * inverse_areas[cluster]);
        for (uint light = 0u; light < LIGHTS; ++light) add(sum.of_light[light], weight, flux.of_light[light]);
    }
    light_hits_0[index] = sum.of_light[0];
    if (LIGHTS == 1u) return;
    light_hits_1[index] = sum.of_light[1];
    light_hits_2[index] = sum.of_light[2];
    light_hits_3[index] = sum.of_light[3];
}
