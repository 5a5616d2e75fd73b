// Ambient accessibility of path vertices [Zhukov]: counts the cosine-distributed rays of a vertex
// that hit nothing within `reach`. Their fraction of all rays is the fraction of reflected light
// that leaves the surroundings. Deterministic. One invocation = one vertex. In: vertices. Out:
// number of such rays for each vertex, or LOOP_TRUNCATED.
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

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint RINGS = 0;
layout(constant_id = 1) const uint SECTORS = 0;

struct AccessibilityPoint {
    vec3 position;
    uint side;  // 2·triangle + (1 if the back side)
};
struct AccessibilityPush {
    uint point_count;
    uint seed;
    uint side_bits;  // of a side, which name it
    float reach;  // metres
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer AccessibilityPoints { AccessibilityPoint accessibility_points[]; };
layout(scalar, binding = 4) writeonly buffer OpenRays { uint open_rays[]; };
layout(scalar, push_constant) uniform Push { AccessibilityPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/gather.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.point_count) return;
    AccessibilityPoint point = accessibility_points[index];
    vec3 normal = surface_at(point.side >> 1).normal;
    if ((point.side & 1u) != 0u) normal = -normal;
    vec3 origin = offset_origin(point.position, normal);
    mat3 frame = frame_around(normal);
    // The seed comes from the point's own bits, so the result is independent of the chunk
    // that holds it.
    uvec3 bits = floatBitsToUint(point.position);
    uint name = hash(bits.x, hash(bits.y, hash(bits.z, point.side & push.side_bits)));
    uint open = 0u;
    for (uint ray = 0u; ray < RINGS * SECTORS; ++ray) {
        Hit hit;
        if (!trace(Ray(origin, frame * stratum_direction(stratum_of(ray), name, push.seed), push.reach), true, hit)) ++open;
    }
    open_rays[index] = loops_completed(push.point_count) ? open : LOOP_TRUNCATED;
}
