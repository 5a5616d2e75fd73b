// Closest hits of an explicit list of rays, or any hits of segments. Deterministic. One invocation
// = one ray. In: origins and directions, metres. Out: distance in units of the direction's length
// (negative: nothing hit) and side, or LOOP_TRUNCATED.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SEGMENTS = 0;  // 1: segments, any hit

struct RayQuery { vec3 origin; vec3 direction; };
struct RayAnswer { float t; uint side; };
struct RaysPush {
    uint ray_count;
    float reach;  // of the rays, in units of their directions
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Queries { RayQuery queries[]; };
layout(scalar, binding = 4) writeonly buffer Answers { RayAnswer answers[]; };
layout(scalar, push_constant) uniform Push { RaysPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.ray_count) return;
    RayQuery query = queries[index];
    Hit hit;
    bool is_hit = trace(Ray(query.origin, query.direction, push.reach), SEGMENTS == 1u, hit);
    bool is_truncated = !loops_completed(push.ray_count);
    if (is_truncated || !is_hit) {
        answers[index] = RayAnswer(-1.0, is_truncated ? LOOP_TRUNCATED : NO_SIDE);
        return;
    }
    bool back = dot(surface_at(hit.triangle).normal, query.direction) > 0.0;
    answers[index] = RayAnswer(hit.t, 2u * hit.triangle + uint(back));
}
