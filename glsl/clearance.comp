// Clearance of candidate cache points: the distance to the nearest surface in their gather
// hemisphere, the R_i of the error metric. [Tabellion] Rays within 10° of the tangent plane do not
// count. Deterministic. One workgroup = one candidate. In: candidates. Out: metres, or the scene's
// size if no ray hits, INTERIOR or UNKNOWN; and the nearest occluder plane.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"

layout(local_size_x_id = 3) in;
layout(constant_id = 0) const uint RINGS = 0;
layout(constant_id = 1) const uint SECTORS = 0;

struct Clearance {
    float distance;  // metres; INTERIOR in a solid
    vec3 occluder;       // nearest occluder plane as in CachePoint, if it faces 45° or more away from the surface; else zero
    int inner;           // probes that meet inner sides, less probes that meet others
};
const float INTERIOR = -1.0;
const float UNKNOWN = -2.0;  // truncated loop

struct ClearancePush {
    uint candidate_count;
    uint seed;
    uint side_bits;    // of a side, which name it
    float scene_size;  // metres
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Candidates { CachePoint candidates[]; };
layout(scalar, binding = 4) writeonly buffer Clearances { Clearance clearances[]; };
layout(scalar, push_constant) uniform Push { ClearancePush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/gather.glsl"

// Rays that find every hit, however far, to tell whether a candidate is in a solid: the nearest hit
// alone may be of another solid there.
const uint PROBES = 8u;

shared float nearest[gl_WorkGroupSize.x];
shared uint nearest_ray[gl_WorkGroupSize.x];
shared int inner_hits[gl_WorkGroupSize.x];  // of probes, less other ones
shared uint min_distance;                   // that a lane has found, as bits: what is further cannot be the nearest

// Ray `number` of all, so that any first ones are spread over the hemisphere. The number of rays,
// 4·k², has no factor of 11.
uint spread(uint number) { return number * 11u % (RINGS * SECTORS); }

// The next float above a positive one: a ray up to there finds hits at the distance itself.
float just_above(float distance) { return uintBitsToFloat(floatBitsToUint(distance) + 1u); }

bool is_inner(Hit hit, vec3 direction) {
    Surface surface = surface_at(hit.triangle);
    return !side_is_active(surface.sides, dot(surface.normal, direction) > 0.0);
}

void main() {
    uint index = flat_workgroup();
    if (index >= push.candidate_count) return;
    CachePoint point = candidates[index];
    vec3 origin = offset_origin(point.position, point.facet);
    mat3 frame = frame_around(point.normal);

    // The seed comes from the point's own bits, so the result is independent of the chunk
    // that holds it.
    uvec3 bits = floatBitsToUint(point.position);
    uint name = hash(bits.x, hash(bits.y, hash(bits.z, point.side & push.side_bits)));

    if (gl_LocalInvocationIndex == 0u) min_distance = floatBitsToUint(push.scene_size);
    barrier();
    float closest = push.scene_size;
    uint closest_ray = NO_TARGET;
    int inner = 0;
    for (uint number = gl_LocalInvocationIndex; number < RINGS * SECTORS; number += gl_WorkGroupSize.x) {
        uint ray = spread(number);
        vec3 local = stratum_direction(stratum_of(ray), name, push.seed);
        Hit hit;
        bool is_probe = number < PROBES;
        // Floats that are not negative compare alike as integers.
        float least = uintBitsToFloat(atomicMin(min_distance, floatBitsToUint(closest)));
        float reach = is_probe ? push.scene_size : min(closest, just_above(least));
        if (local.z > 0.1736 && trace(Ray(origin, frame * local, reach), false, hit)) {
            if (is_probe) inner += is_inner(hit, frame * local) ? 1 : -1;
            closest_ray = hit.t < closest ? ray : closest_ray;
            closest = min(hit.t, closest);
        }
    }
    if (!loops_completed(push.candidate_count)) closest = UNKNOWN;
    nearest[gl_LocalInvocationIndex] = closest;
    nearest_ray[gl_LocalInvocationIndex] = closest_ray;
    inner_hits[gl_LocalInvocationIndex] = inner;
    for (uint stride = gl_WorkGroupSize.x / 2u; stride > 0u; stride /= 2u) {
        barrier();
        uint other = gl_LocalInvocationIndex + stride;
        if (gl_LocalInvocationIndex < stride) inner_hits[gl_LocalInvocationIndex] += inner_hits[other];
        if (gl_LocalInvocationIndex < stride && nearest[other] < nearest[gl_LocalInvocationIndex]) {
            nearest[gl_LocalInvocationIndex] = nearest[other];
            nearest_ray[gl_LocalInvocationIndex] = nearest_ray[other];
        }
    }
    if (gl_LocalInvocationIndex != 0u) return;
    vec3 occluder = vec3(0.0);
    Hit hit;
    vec3 direction = frame * stratum_direction(stratum_of(min(nearest_ray[0], RINGS * SECTORS - 1u)), name, push.seed);
    if (nearest[0] != UNKNOWN && nearest_ray[0] != NO_TARGET && trace(Ray(origin, direction, just_above(nearest[0])), false, hit)) {
        vec3 plane = surface_at(hit.triangle).normal;
        float distance = dot(plane, hit_position(hit) - point.position);
        // A standing wall or a covering surface: the view of the scene changes behind either.
        bool back = dot(plane, direction) > 0.0;
        if (dot(back ? -plane : plane, point.normal) < 0.7071 && distance != 0.0) occluder = plane / distance;
        // The nearest hit of a candidate in a solid, or most of its hits, are inner sides, which
        // take no part in transport.
        if (inner_hits[0] > 0 || is_inner(hit, direction)) nearest[0] = INTERIOR;
    }
    if (nearest[0] == UNKNOWN || !loops_completed(push.candidate_count)) clearances[index] = Clearance(UNKNOWN, vec3(0.0), 0);
    else clearances[index] = Clearance(nearest[0], occluder, inner_hits[0]);
}
