// Final gathering, step 2: irradiance at cache points and its gradients, from the stored rays. [Yue §3; Krivanek]
// Deterministic. One workgroup = one cache point of a list. In: bundles of rays, radiance of reflectors (W/m²/sr). Out: records.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/colour.glsl"

layout(local_size_x_id = 3) in;
layout(constant_id = 0) const uint SHINES = 0;  // 1: some reflectors shine

struct GatherPush {
    uint first_point;      // of the bound part of the bundles
    uint end_point;        // its end
    uint reflector_bits;   // width of the reflector field in a bundle
    float least_distance;  // unit of gradients under movement, metres
    float turn_unit;       // of a bundle's share in the gradient under rotation
    float stratum;         // π over the rays of a hemisphere: what each counts for
};

layout(binding = 0) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 1) readonly buffer FirstBundles { uint first_bundles[]; };  // of each point of the part, and the end
// Rays of a point that meet one reflector: reflector | (number of rays - 1) << reflector_bits; their shares in the gradients under
// movement (two numbers of eight bits, and the exponent of both in five), then under rotation (four, four and three). Neighbours in a
// workgroup read neighbours here, and, because a point's bundles are in the order of their reflectors, close places of the radiances.
layout(binding = 2) uniform usamplerBuffer Bundles;
layout(scalar, binding = 3) readonly buffer BundleColours { uint bundle_colours[]; };  // packed; only in scenes with images
layout(binding = 4) uniform usamplerBuffer Radiances;
layout(scalar, binding = 5) readonly buffer Shines { vec3 shines[]; };
layout(scalar, binding = 6) writeonly buffer Records { Record records[]; };
layout(scalar, binding = 7) readonly buffer RecordOffsets { uint record_offsets[]; };  // listed ones before each, and all
layout(scalar, binding = 8) readonly buffer ListedRecords { uint listed_records[]; };  // in order
layout(scalar, push_constant) uniform Push { GatherPush push; };

const uint SUMS = 5u;  // irradiance; translation and rotation along tangent and bitangent
shared vec3 sums[SUMS * gl_WorkGroupSize.x];
const uint MOVEMENT_EXPONENT = 26u;  // its unit is 2 to the minus that

// Two numbers and what they are multiplied with.
vec2 unpack_pair(uint bits, int width, uint exponent) {
    ivec2 numbers = ivec2(bitfieldExtract(int(bits), 0, width), bitfieldExtract(int(bits), width, width));
    return uintBitsToFloat(exponent << 23u) * vec2(numbers);
}

void main() {
    uint place = record_offsets[push.first_point] + flat_workgroup();
    if (place >= record_offsets[push.end_point]) return;
    uint index = listed_records[place];
    uint row = index - push.first_point;
    uint thread = gl_LocalInvocationIndex;
    uint reflectors = (1u << push.reflector_bits) - 1u;

    vec3 sum[SUMS] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    uint end = first_bundles[row + 1u];
    for (uint i = first_bundles[row] + thread; i < end; i += gl_WorkGroupSize.x) {
        uvec2 bundle = pair_at(Bundles, i);
        uint reflector = bundle.x & reflectors;
        vec3 radiance = uintBitsToFloat(texelFetch(Radiances, int(reflector)).xyz);
        if (HAS_TEXTURES != 0u) radiance *= unpack_colour(bundle_colours[i]);
        if (SHINES == 1u) radiance += shines[reflector];
        vec2 movement = unpack_pair(bundle.y, 8, 127u - MOVEMENT_EXPONENT + ((bundle.y >> 16u) & 31u));
        vec2 turn = unpack_pair(bundle.y >> 21u, 4, 127u + (bundle.y >> 29u));
        sum[0] += float((bundle.x >> push.reflector_bits) + 1u) * radiance;
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
        CachePoint point = cache_point_at(CachePoints, index);
        mat3 frame = frame_around(point.normal);
        float unit = 1.0 / push.least_distance;
        vec3 along_x = unit * sums[gl_WorkGroupSize.x];
        vec3 along_y = unit * sums[2u * gl_WorkGroupSize.x];
        float turn_unit = push.turn_unit * push.stratum;
        vec3 turn_x = turn_unit * sums[3u * gl_WorkGroupSize.x];
        vec3 turn_y = turn_unit * sums[4u * gl_WorkGroupSize.x];
        // (n_i × n)·g for a rotational gradient g in the tangent plane is n·(g × n_i).
        records[index] = Record(point.position, push.stratum * sums[0],
                                outerProduct(frame[0], along_x) + outerProduct(frame[1], along_y),
                                outerProduct(frame[0], turn_y) - outerProduct(frame[1], turn_x));
    }
}
