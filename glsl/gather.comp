// Final gathering, step 2: irradiance of cache points and its gradients, from merged rays. [Yue
// §3; Krivanek] Deterministic. RECORD_LANES invocations = one listed cache point. In: merged rays,
// radiance of gather targets (W/m²/sr). Out: records.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/colour.glsl"
#include "include/record_lanes.glsl"

layout(local_size_x = RECORD_GROUP) in;
layout(constant_id = 0) const uint IS_GLOSSY = 0;  // 1: some targets are glossy

struct GatherPush {
    uint first_point;      // of the bound buffer of the merged rays
    uint end_point;        // its end
    uint target_bits;   // width of the gather target field in a merged ray
    float min_distance;  // unit of gradients under movement, metres
    float rotation_unit;       // unit of the packed rotational gradient of a merged ray
    float stratum;         // π over the rays of a hemisphere: the weight of each ray
};

layout(binding = 0) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 1) readonly buffer MergedRayOffsets { uint merged_ray_offsets[]; };  // CSR offsets: one for each point of the bound buffer, and the end
// Two merged rays a texel. The first word holds gather target | (number of rays - 1) <<
// target_bits. The second holds their weights in the translational gradient (two 8-bit numbers and
// a common 5-bit exponent), then in the rotational gradient (4, 4 and 3 bits). The invocations of a
// point read adjacent texels. A point's merged rays are sorted by target, so that the radiances
// they read are close in memory, too.
layout(binding = 2) uniform usamplerBuffer MergedRays;
layout(scalar, binding = 3) readonly buffer MergedRayColours { uint merged_ray_colours[]; };  // packed; only in scenes with images
layout(binding = 4) uniform usamplerBuffer Radiances;
layout(scalar, binding = 5) readonly buffer LobeRadiances { vec3 lobe_radiances[]; };  // only in scenes with images
layout(scalar, binding = 6) writeonly buffer Records { Record records[]; };
layout(scalar, binding = 7) readonly buffer RecordOffsets { uint record_offsets[]; };  // exclusive prefix sum over the records, and the total
layout(scalar, binding = 8) readonly buffer ListedRecords { uint listed_records[]; };  // in order
layout(scalar, push_constant) uniform Push { GatherPush push; };

const uint SUMS = 5u;  // irradiance; translation and rotation along tangent and bitangent
shared vec3 sums[SUMS * RECORD_GROUP];
const uint MOVEMENT_EXPONENT = 26u;  // its unit is 2 to the minus that

// Two signed integers of `width` bits, times 2^(exponent - 127).
vec2 unpack_pair(uint bits, int width, uint exponent) {
    ivec2 numbers = ivec2(bitfieldExtract(int(bits), 0, width), bitfieldExtract(int(bits), width, width));
    return uintBitsToFloat(exponent << 23u) * vec2(numbers);
}

// Adds one merged ray, or nothing if it belongs to another point.
void add(inout vec3 sum[SUMS], uint index, uvec2 merged_ray, bool is_ours) {
    uint target_index = merged_ray.x & ((1u << push.target_bits) - 1u);
    vec3 radiance = uintBitsToFloat(texelFetch(Radiances, int(target_index)).xyz);
    if (HAS_TEXTURES != 0u && is_ours) radiance *= unpack_colour(merged_ray_colours[index]);
    if (HAS_TEXTURES != 0u && IS_GLOSSY == 1u) radiance += lobe_radiances[target_index];
    radiance = is_ours ? radiance : vec3(0.0);
    vec2 movement = unpack_pair(merged_ray.y, 8, 127u - MOVEMENT_EXPONENT + ((merged_ray.y >> 16u) & 31u));
    vec2 rotation = unpack_pair(merged_ray.y >> 21u, 4, 127u + (merged_ray.y >> 29u));
    sum[0] += float((merged_ray.x >> push.target_bits) + 1u) * radiance;
    sum[1] += movement.x * radiance;
    sum[2] += movement.y * radiance;
    sum[3] += rotation.x * radiance;
    sum[4] += rotation.y * radiance;
}

// Sums over the invocations of each point, in order; each of them gets the total.
void add_up(inout vec3 sum[SUMS], uint lane) {
    uint first = gl_LocalInvocationIndex - lane;
    for (uint k = 0u; k < SUMS; ++k) sums[k * RECORD_GROUP + gl_LocalInvocationIndex] = sum[k];
    barrier();
    if (lane < SUMS) {
        vec3 total = vec3(0.0);
        for (uint i = first; i < first + RECORD_LANES; ++i) total += sums[lane * RECORD_GROUP + i];
        sums[lane * RECORD_GROUP + first] = total;
    }
    barrier();
    for (uint k = 0u; k < SUMS; ++k) sum[k] = sums[k * RECORD_GROUP + first];
}

void main() {
    uint lane = gl_LocalInvocationIndex % RECORD_LANES;
    uint place = record_offsets[push.first_point] + flat_workgroup() * RECORDS + gl_LocalInvocationIndex / RECORD_LANES;
    bool is_listed = place < record_offsets[push.end_point];
    uint index = is_listed ? listed_records[place] : push.first_point;
    uint row = index - push.first_point;

    vec3 sum[SUMS] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    uint first = merged_ray_offsets[row];
    uint end = is_listed ? merged_ray_offsets[row + 1u] : first;
    for (uint i = (first & ~1u) + 2u * lane; i < end; i += 2u * RECORD_LANES) {
        uvec4 both = texelFetch(MergedRays, int(i >> 1));
        add(sum, i, both.xy, i >= first);
        add(sum, i + 1u, both.zw, i + 1u < end);
    }
    if (RECORD_LANES > 1u) add_up(sum, lane);
    if (!is_listed || lane > 0u) return;

    CachePoint point = cache_point_at(CachePoints, index);
    mat3 frame = frame_around(point.normal);
    float unit = 1.0 / push.min_distance;
    vec3 along_x = unit * sum[1];
    vec3 along_y = unit * sum[2];
    float rotation_unit = push.rotation_unit * push.stratum;
    vec3 turn_x = rotation_unit * sum[3];
    vec3 turn_y = rotation_unit * sum[4];
    // (n_i × n)·g for a rotational gradient g in the tangent plane is n·(g × n_i).
    records[index] = Record(point.position, push.stratum * sum[0],
                            outerProduct(frame[0], along_x) + outerProduct(frame[1], along_y),
                            outerProduct(frame[0], turn_y) - outerProduct(frame[1], turn_x));
}
