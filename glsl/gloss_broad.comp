// Glossy pixels, step 6: adds the light of broad lobes, from lobes at records. Deterministic. One
// invocation = one glossy pixel. In: surfaces at the pixels, fragments, splat weights, lobes at
// records. Out: the mean over the glossy surface that the pixel shows, W/m²/sr, added to that of
// its rays.
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
#include "include/antialias.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;

struct GlossBroadPush {
    EdgeCapacity edge_capacity;
    uint width;
    uint height;
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
layout(scalar, binding = 3) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 4) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(binding = 5) uniform usamplerBuffer Fragments;
layout(binding = 6) uniform usamplerBuffer FragmentSurfaces;
layout(scalar, binding = 7) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 8) readonly buffer GlossPixels { uint gloss_pixels[]; };
layout(binding = 9) uniform usamplerBuffer WeightRanges;  // of each pixel
layout(binding = 10) uniform usamplerBuffer EdgeWeightRanges;  // of each edge point
layout(binding = 11) uniform usamplerBuffer Weights;
layout(binding = 12) uniform usamplerBuffer GlossRecords;  // exponent by exponent
layout(scalar, binding = 13) buffer GlossRadiance { PixelGloss gloss_radiance[]; };
layout(scalar, push_constant) uniform Push { GlossBroadPush push; };

#include "include/surfaces.glsl"
#include "include/seen_fragments.glsl"
#include "include/record_ranges.glsl"

float exponent_of(uint place) { return vec4(push.first_exponents, push.other_exponents)[place]; }

// Radiance that the lobe of one exponent brings, per unit of specular albedo: the mean over the
// records in a range of weights, each turned to that mirror direction. A record counts by its splat
// weight, and less the further its own direction is off beside the lobe's width.
vec3 lobe_from_records(uvec2 range, vec3 mirror, uint place) {
    vec3 sum = vec3(0.0);
    float total = 0.0;
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
vec3 lobe_from_records(uvec2 range, PixelSurface point, float exponent) {
    vec3 mirror = reflect(normalize(point.position - push.eye), point.normal);
    uint next = 0u;
    while (next + 1u < push.exponent_count && exponent_of(next) < exponent) ++next;
    vec3 sharper = lobe_from_records(range, mirror, next);
    if (next == 0u || exponent_of(next) == exponent) return sharper;
    float fraction = log(exponent_of(next) / exponent) / log(exponent_of(next) / exponent_of(next - 1u));
    return mix(sharper, lobe_from_records(range, mirror, next - 1u), fraction);
}

Reflectance material_at(PixelSurface point) { return materials[surface_at(point.side >> 1).material]; }

// Radiance that a surface reflects by its lobe, if that is broad, from the records in a range of
// weights.
vec3 broad_gloss(uvec2 range, PixelSurface point) {
    Reflectance own = material_at(point);
    return is_broad(own, push.broad_exponents) ? own.specular * lobe_from_records(range, point, own.exponent) : vec3(0.0);
}

void main() {
    uint index = flat_invocation();
    uvec2 size = uvec2(push.width, push.height);
    uint pixel_count = size.x * size.y;
    if (index >= gloss_offsets[2u * pixel_count]) return;
    uint pixel = gloss_pixels[index];
    SeenFragments shown = fragments_of(pixel, pixel_count, push.edge_capacity);
    if (!shown.is_edge) {
        gloss_radiance[pixel].indirect += broad_gloss(pair_at(WeightRanges, pixel), pixel_surface_at(Pixels, pixel));
        return;
    }
    vec3 sum = vec3(0.0);
    float all = 0.0;
    for (uint i = shown.first; i < shown.end; ++i) {
        PixelSurface point = pixel_surface_at(FragmentSurfaces, i);
        if (!has_lobe(material_at(point))) continue;
        Fragment fragment = fragment_at(Fragments, i);
        float samples = float(samples_of(fragment));
        all += samples;
        sum += samples * broad_gloss(weights_of(fragment, pixel, size), point);
    }
    gloss_radiance[pixel].indirect += sum / max(all, 1.0);
}
