// Lobes at records, step 2: radiance that a broad Phong lobe at a cache point reflects towards the
// camera, from the rays of its hemisphere, and the change of that radiance as the lobe turns. If
// all rays of the hemisphere met something, the lobe's albedo times the mean radiance along them,
// weighted by the lobe: the number of rays that happen to lie in the lobe cancels. Deterministic.
// One invocation = one record and one exponent. In: merged rays with directions, radiance of gather
// targets (W/m²/sr). Out: lobes, W/m²/sr per unit of specular albedo.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/colour.glsl"
#include "include/gloss.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;

// Cells of the table of an exponent's albedos.
const uint ALBEDO_CELLS = 32u;

struct GlossRecordsPush {
    vec3 eye;
    uint first_point;   // of the bound buffer of the merged rays
    uint end_point;     // its end
    uint record_count;  // of all buffers
    uint target_bits;   // width of the gather target field in a merged ray
    float rays;         // of a hemisphere
    uint exponent_count;
    vec2 first_exponents;  // of lobes at records, ascending
    vec2 other_exponents;
};

layout(binding = 0) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 1) readonly buffer MergedRayOffsets { uint merged_ray_offsets[]; };  // CSR offsets: one for each point of the bound buffer, and the end
layout(binding = 2) uniform usamplerBuffer MergedRays;           // see gather.comp
layout(binding = 3) uniform usamplerBuffer MergedRayDirections;  // packed
layout(scalar, binding = 4) readonly buffer MergedRayColours { uint merged_ray_colours[]; };  // packed; only in scenes with images
layout(binding = 5) uniform usamplerBuffer Radiances;
layout(scalar, binding = 6) readonly buffer LobeRadiances { vec3 lobe_radiances[]; };  // only in scenes with images
layout(scalar, binding = 7) readonly buffer IsRead { uint is_read[]; };
layout(scalar, binding = 8) readonly buffer LobeAlbedos { float lobe_albedos[]; };  // of each exponent, by the cosine of the mirror direction
layout(scalar, binding = 9) writeonly buffer GlossRecords { GlossRecord gloss_records[]; };  // exponent by exponent
layout(scalar, push_constant) uniform Push { GlossRecordsPush push; };

void main() {
    uint points = push.end_point - push.first_point;
    uint row = flat_invocation() % points, place = flat_invocation() / points;
    uint index = push.first_point + row;
    if (place >= push.exponent_count || is_read[index] == 0u) return;
    float exponent = vec4(push.first_exponents, push.other_exponents)[place];
    CachePoint point = cache_point_at(CachePoints, index);
    vec3 mirror = reflect(normalize(point.position - push.eye), point.normal);
    vec3 sum = vec3(0.0);
    mat3 sum_change = mat3(0.0);
    float weights = 0.0, rays = 0.0;
    vec3 weights_change = vec3(0.0);
    for (uint i = merged_ray_offsets[row]; i < merged_ray_offsets[row + 1u]; ++i) {
        uint word = pair_at(MergedRays, i).x;
        uint target_index = word & ((1u << push.target_bits) - 1u);
        float count = float((word >> push.target_bits) + 1u);
        vec3 direction = unpack_direction(word_at(MergedRayDirections, i));
        float weight = count * phong_lobe(mirror, direction, exponent);
        // The gradient of cosⁿα is n·cosⁿ⁻¹α times the direction.
        vec3 change = exponent / max(dot(mirror, direction), 1e-3) * weight * direction;
        weights += weight;
        weights_change += change;
        rays += count;
        vec4 read = numbers(texelFetch(Radiances, int(target_index)));
        vec3 radiance = read.xyz;
        if (HAS_TEXTURES != 0u) radiance = radiance * unpack_colour(merged_ray_colours[i]) + lobe_radiances[target_index];
        // Highlights hold the sky.
        if (read.w == IS_SKY_CELL) radiance = vec3(0.0);
        sum += weight * radiance;
        sum_change += outerProduct(change, radiance);
    }
    // (n+2)/(2π)·cosⁿα times π over the rays of the hemisphere.
    float scale = 0.5 * (exponent + 2.0) / push.rays;
    vec3 radiance = scale * sum;
    mat3 change = scale * sum_change;
    if (rays == push.rays && weights > 0.0) {
        float cell = clamp(dot(mirror, point.normal), 0.0, 0.9999) * float(ALBEDO_CELLS);
        uint first = place * (ALBEDO_CELLS + 1u) + uint(cell);
        float slope = lobe_albedos[first + 1u] - lobe_albedos[first];
        float albedo = lobe_albedos[first] + fract(cell) * slope;
        vec3 mean = sum / weights;
        radiance = albedo * mean;
        change = (albedo / weights) * (sum_change - outerProduct(weights_change, mean)) + outerProduct(slope * float(ALBEDO_CELLS) * point.normal, mean);
    }
    gloss_records[place * push.record_count + index] = GlossRecord(radiance, mirror, change, 0.0);
}
