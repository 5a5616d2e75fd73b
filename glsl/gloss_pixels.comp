// Glossy pixels, step 5: radiance that the Phong lobes of a pixel reflect towards the camera, from
// its rays, or for a broad lobe from records. After a light edit under a still camera only this
// step runs for glossy pixels. Deterministic. One invocation = one glossy pixel. In: rays,
// irradiance of clusters, light that glossy surfaces send back (W/m²); lobes at records, splat
// weights. Out: radiance, W/m²/sr.
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
    uint pixel_count;   // of the image
    uint max_samples;  // of a pixel
    uint capacity;      // of the list of samples
    uint cluster_bits;  // width of the cluster field in GlossRay.target
    vec3 eye;
    uint weight_capacity;
    uint record_count;
    uint broad_exponents;  // see `is_broad`
    uint exponent_count;
    vec2 first_exponents;  // of lobes at records, ascending
    vec2 other_exponents;
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 1) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 2) uniform usamplerBuffer Pixels;
layout(scalar, binding = 3) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 4) readonly buffer GlossPixels { uint gloss_pixels[]; };
layout(scalar, binding = 5) readonly buffer GlossRays { GlossRay gloss_rays[]; };
layout(scalar, binding = 6) readonly buffer Irradiance { vec3 irradiance[]; };
layout(scalar, binding = 7) readonly buffer GlossHits { vec3 gloss_hits[]; };  // of each sample: light of glossy surfaces on its rays
layout(scalar, binding = 8) readonly buffer Highlights { vec3 highlights[]; };  // of each sample, per unit of specular albedo, W/m²/sr
layout(scalar, binding = 9) writeonly buffer GlossRadiance { PixelGloss gloss_radiance[]; };
layout(scalar, binding = 10) readonly buffer GlossColours { uint gloss_colours[]; };  // of rays, packed; only in scenes with images
layout(scalar, binding = 11) readonly buffer InverseAreas { float inverse_areas[]; };  // of clusters, 1/m²
layout(scalar, binding = 12) readonly buffer GlossBins { GlossBin gloss_bins[]; };
layout(scalar, binding = 13) readonly buffer GlossFluxes { vec3 gloss_fluxes[]; };  // of each gloss bin, W
layout(binding = 14) uniform usamplerBuffer WeightRanges;  // of each pixel
layout(binding = 15) uniform usamplerBuffer Weights;
layout(binding = 16) uniform usamplerBuffer GlossRecords;  // exponent by exponent
layout(scalar, push_constant) uniform Push { GlossPixelsPush push; };

#include "include/surfaces.glsl"

float exponent_of(uint place) { return vec4(push.first_exponents, push.other_exponents)[place]; }

// Radiance that the lobe of one exponent brings, per unit of specular albedo: the mean over the
// pixel's records, each turned to the pixel's mirror direction. A record counts by its splat
// weight, and less the further its own direction is off beside the lobe's width.
vec3 lobe_from_records(uint pixel, vec3 mirror, uint place) {
    vec3 sum = vec3(0.0);
    float total = 0.0;
    uvec2 range = pair_at(WeightRanges, pixel);
    for (uint i = range.x; i < min(range.y, push.weight_capacity); ++i) {
        uvec2 splat = pair_at(Weights, i);  // a `SplatWeight`
        GlossRecord record = gloss_record_at(GlossRecords, place * push.record_count + splat.x);
        float weight = abs(uintBitsToFloat(splat.y)) * max(exp(-exponent_of(place) * off_mirror(mirror, record.mirror)), 1e-4);
        vec3 turned = mirror - dot(mirror, record.mirror) * record.mirror;
        sum += weight * max(record.radiance + turned * record.change, vec3(0.0));
        total += weight;
    }
    return sum / max(total, 1e-12);
}

// The same for any exponent: between those of the lobes at records, it interpolates.
vec3 lobe_from_records(uint pixel, PixelSurface point, float exponent) {
    vec3 mirror = reflect(normalize(point.position - push.eye), point.normal);
    uint next = 0u;
    while (next + 1u < push.exponent_count && exponent_of(next) < exponent) ++next;
    vec3 sharper = lobe_from_records(pixel, mirror, next);
    if (next == 0u || exponent_of(next) == exponent) return sharper;
    float fraction = log(exponent_of(next) / exponent) / log(exponent_of(next) / exponent_of(next - 1u));
    return mix(sharper, lobe_from_records(pixel, mirror, next - 1u), fraction);
}

void main() {
    uint index = flat_invocation();
    uint count = gloss_offsets[push.pixel_count];
    if (index >= count) return;
    uint samples = gloss_samples_per_pixel(count, push.max_samples, push.capacity);
    uint rays = LOBE_RAYS * samples;
    uint pixel = gloss_pixels[index];
    PixelSurface point = pixel_surface_at(Pixels, pixel);
    Reflectance own = materials[surface_at(point.side >> 1).material];
    vec3 direct = vec3(0.0);
    for (uint i = index * samples; i < (index + 1u) * samples; ++i) direct += highlights[i];
    float fraction = 1.0 / float(max(samples, 1u));
    direct *= fraction * own.specular;
    if (is_broad(own, push.broad_exponents)) {
        gloss_radiance[pixel] = PixelGloss(direct, own.specular * lobe_from_records(pixel, point, own.exponent));
        return;
    }
    vec3 sum = vec3(0.0);
    for (uint i = index * rays; i < (index + 1u) * rays; ++i) {
        GlossRay ray = gloss_rays[i];
        if (ray.target == NO_TARGET) continue;
        uint cluster = ray.target & ((1u << push.cluster_bits) - 1u);
        Reflectance material = materials[ray.target >> push.cluster_bits];
        vec3 radiosity = material.diffuse * irradiance[cluster];
        if (HAS_TEXTURES != 0u) radiosity *= unpack_colour(gloss_colours[i]);
        if (ray.gloss_bin != NO_GLOSS_BIN) radiosity += inverse_areas[gloss_bins[ray.gloss_bin].cluster] * gloss_fluxes[ray.gloss_bin];
        sum += ray.weight * radiosity;
    }
    for (uint i = index * samples; i < (index + 1u) * samples; ++i) sum += gloss_hits[i];
    gloss_radiance[pixel] = PixelGloss(direct, fraction / (PI * float(LOBE_RAYS)) * own.specular * sum);
}
