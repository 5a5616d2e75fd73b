// Glossy pixels, step 5: radiance that the Phong lobes at a pixel's samples reflect towards the
// camera, from highlights and rays. After a light edit under a still camera only this step and the
// next run for glossy pixels. Deterministic. One invocation = one glossy pixel. In: samples, rays,
// irradiance of clusters, light that glossy surfaces send back (W/m²). Out: the mean over the
// samples, W/m²/sr.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/gloss_rays.glsl"
#include "include/colour.glsl"

layout(local_size_x = 64) in;

struct GlossPixelsPush {
    uint pixel_count;      // of the image
    uint max_samples;     // of a pixel
    uint capacity;         // of the list of samples
    uint cluster_bits;     // width of the cluster field in GlossRay.target
    uint broad_exponents;  // see `is_broad`
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(binding = 1) uniform usamplerBuffer Materials;
layout(scalar, binding = 2) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 3) readonly buffer GlossPixels { uint gloss_pixels[]; };
layout(scalar, binding = 4) readonly buffer GlossSamples { PixelSurface gloss_samples[]; };
layout(scalar, binding = 5) readonly buffer GlossRays { GlossRay gloss_rays[]; };
layout(scalar, binding = 6) readonly buffer Irradiance { vec3 irradiance[]; };
layout(scalar, binding = 7) readonly buffer GlossHits { vec3 gloss_hits[]; };  // of each sample: light of glossy surfaces on its rays
layout(scalar, binding = 8) readonly buffer Highlights { vec3 highlights[]; };  // of each sample, per unit of specular albedo, W/m²/sr
layout(scalar, binding = 9) writeonly buffer GlossRadiance { PixelGloss gloss_radiance[]; };
layout(scalar, binding = 10) readonly buffer GlossColours { uint gloss_colours[]; };  // of rays, packed; only in scenes with images
layout(scalar, binding = 11) readonly buffer InverseAreas { float inverse_areas[]; };  // of clusters, 1/m²
layout(scalar, binding = 12) readonly buffer GlossBins { GlossBin gloss_bins[]; };
layout(scalar, binding = 13) readonly buffer GlossFluxes { vec3 gloss_fluxes[]; };  // of each gloss bin, W
layout(scalar, binding = 14) readonly buffer GlossParts { GlossPart gloss_parts[]; };  // of the samples
layout(scalar, push_constant) uniform Push { GlossPixelsPush push; };

#include "include/surfaces.glsl"

// Radiosity along a ray, weighted, W/m².
vec3 brought_by(uint index) {
    GlossRay ray = gloss_rays[index];
    if (ray.target == NO_TARGET) return vec3(0.0);
    uint cluster = ray.target & ((1u << push.cluster_bits) - 1u);
    Reflectance material = reflectance_at(Materials, ray.target >> push.cluster_bits);
    vec3 radiosity = material.diffuse * irradiance[cluster];
    if (HAS_TEXTURES != 0u) radiosity *= unpack_colour(gloss_colours[index]);
    if (ray.gloss_bin != NO_GLOSS_BIN) radiosity += inverse_areas[gloss_bins[ray.gloss_bin].cluster] * gloss_fluxes[ray.gloss_bin];
    return ray.weight * radiosity;
}

void main() {
    uint index = flat_invocation();
    GlossCounts counts = gloss_counts(gloss_offsets[push.pixel_count], gloss_offsets[2u * push.pixel_count], push.max_samples, push.capacity);
    if (index >= counts.pixels.x + counts.pixels.y) return;
    uvec2 range = samples_of_pixel(counts, index);
    vec3 direct = vec3(0.0);
    vec3 indirect = vec3(0.0);
    for (uint i = range.x; i < range.y; ++i) {
        Reflectance own = reflectance_at(Materials, surface_at(gloss_samples[i].side >> 1).material);
        float weight = gloss_parts[i].weight;
        direct += weight * own.specular * highlights[i];
        // Without a lobe that takes rays, no light on them is found.
        if (!has_lobe(own) || is_broad(own, push.broad_exponents)) continue;
        vec3 sum = gloss_hits[i];
        for (uint ray = LOBE_RAYS * i; ray < LOBE_RAYS * (i + 1u); ++ray) sum += brought_by(ray);
        indirect += weight * own.specular * sum;
    }
    gloss_radiance[gloss_pixels[index]] = PixelGloss(direct, indirect / (PI * float(LOBE_RAYS)));
}
