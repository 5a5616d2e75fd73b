// Final gathering: irradiance at every cache point and its gradients, from the stored rays. [Yue §3; Krivanek]
// Deterministic. One workgroup = one cache point of a list. In: gather rays, cluster irradiance (W/m²). Out: their records.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/colour.glsl"

layout(local_size_x_id = 3) in;
layout(constant_id = 0) const uint RINGS = 0;
layout(constant_id = 1) const uint SECTORS = 0;
layout(constant_id = 2) const uint SHINES = 0;  // 1: targets beyond the clusters are slots

struct GatherPush {
    uint first_point;      // of the bound part of the table of rays
    uint end_point;        // its end
    uint cluster_bits;     // width of the cluster field in GatherRay.target
    float least_distance;  // unit of GatherRay.gradient, metres
    uint cluster_count;
};

layout(scalar, binding = 0) readonly buffer CachePoints { CachePoint cache_points[]; };
layout(scalar, binding = 1) readonly buffer Turns { vec2 turns[]; };  // of each stratum: tanθ across its azimuth
layout(scalar, binding = 2) readonly buffer GatherRays { GatherRay gather_rays[]; };
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 4) readonly buffer Irradiance { vec3 irradiance[]; };
layout(scalar, binding = 5) readonly buffer InverseAreas { float inverse_areas[]; };  // of clusters, 1/m²
layout(scalar, binding = 6) readonly buffer GlossSlots { GlossSlot gloss_slots[]; };
layout(scalar, binding = 7) readonly buffer GlossFluxes { vec3 gloss_fluxes[]; };     // of slots, W
layout(scalar, binding = 8) writeonly buffer Records { Record records[]; };
layout(scalar, binding = 9) readonly buffer RayColours { uint ray_colours[]; };  // packed; only in scenes with images
layout(scalar, binding = 10) readonly buffer RecordOffsets { uint record_offsets[]; };  // listed ones before each, and all
layout(scalar, binding = 11) readonly buffer ListedRecords { uint listed_records[]; };  // in order
layout(scalar, push_constant) uniform Push { GatherPush push; };

const uint SUMS = 5u;  // irradiance; translation and rotation along tangent and bitangent
shared vec3 sums[SUMS * gl_WorkGroupSize.x];

// π times the radiance that comes back along a ray of that index, W/m².
vec3 radiosity(uint target, uint ray) {
    vec3 albedo = materials[target >> push.cluster_bits].diffuse;
    if (HAS_TEXTURES != 0u) albedo *= unpack_colour(ray_colours[ray]);
    uint cluster = target & ((1u << push.cluster_bits) - 1u);
    if (SHINES == 0u || cluster < push.cluster_count) return albedo * irradiance[cluster];
    uint slot = cluster - push.cluster_count;
    cluster = gloss_slots[slot].cluster;
    return albedo * irradiance[cluster] + gloss_fluxes[slot] * inverse_areas[cluster];
}

void main() {
    uint place = record_offsets[push.first_point] + flat_workgroup();
    if (place >= record_offsets[push.end_point]) return;
    uint index = listed_records[place];
    uint row = index - push.first_point;
    uint thread = gl_LocalInvocationIndex;

    vec3 sum[SUMS] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    for (uint i = thread; i < RINGS * SECTORS; i += gl_WorkGroupSize.x) {
        GatherRay ray = gather_rays[row * RINGS * SECTORS + i];
        if (ray.target == NO_TARGET) continue;
        vec3 radiance = radiosity(ray.target, row * RINGS * SECTORS + i) * (1.0 / PI);
        vec2 movement = unpackHalf2x16(ray.gradient);
        vec2 turn = turns[i];
        sum[0] += radiance;
        sum[1] += movement.x * radiance;
        sum[2] += movement.y * radiance;
        sum[3] += turn.x * radiance;
        sum[4] += turn.y * radiance;
    }
    for (uint k = 0u; k < SUMS; ++k) sums[k * gl_WorkGroupSize.x + thread] = sum[k];
    barrier();
    if (thread < SUMS) {
        vec3 total = vec3(0.0);
        for (uint i = 0u; i < gl_WorkGroupSize.x; ++i) total += sums[thread * gl_WorkGroupSize.x + i];
        sums[thread * gl_WorkGroupSize.x] = total;
    }
    barrier();
    if (thread == 0u) {
        CachePoint point = cache_points[index];
        mat3 frame = frame_around(point.normal);
        float stratum = PI / float(RINGS * SECTORS);
        float unit = 1.0 / push.least_distance;
        vec3 along_x = unit * sums[gl_WorkGroupSize.x];
        vec3 along_y = unit * sums[2u * gl_WorkGroupSize.x];
        vec3 turn_x = stratum * sums[3u * gl_WorkGroupSize.x];
        vec3 turn_y = stratum * sums[4u * gl_WorkGroupSize.x];
        // (n_i × n)·g for a rotational gradient g in the tangent plane is n·(g × n_i).
        records[index] = Record(point.position, stratum * sums[0],
                                outerProduct(frame[0], along_x) + outerProduct(frame[1], along_y),
                                outerProduct(frame[0], turn_y) - outerProduct(frame[1], turn_x));
    }
}
