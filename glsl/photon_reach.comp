// Distance from each irradiance point along its surface to the next wall, in sixteen directions.
// Deterministic. One invocation = one point. In: points. Out: a byte a sector, in 1/255 of the
// radius; 255: no wall that near.
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
#include "include/photons.glsl"

layout(local_size_x = 64) in;

struct PhotonReachPush {
    float radius;  // metres
    uint first_point;
    uint end_point;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(scalar, binding = 2) readonly buffer Points { MapEntry points[]; };
layout(scalar, binding = 3) writeonly buffer Reaches { uvec4 reaches[]; };
layout(scalar, binding = 4) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { PhotonReachPush push; };

#include "include/triangles.glsl"
#include "include/bvh.glsl"

void main() {
    uint index = push.first_point + flat_invocation();
    if (index >= push.end_point) return;
    MapEntry point = points[index];
    mat3 frame = frame_around(point.normal);
    // The ray runs at the height up to which points count as the same plane: a hollow is no wall.
    vec3 origin = offset_origin(point.position, point.normal) + SAME_PLANE * push.radius * point.normal;
    uvec4 reach = uvec4(0u);
    for (uint sector = 0u; sector < 16u; ++sector) {
        vec2 along = sector_direction(sector);
        Hit hit;
        uint steps = 255u;
        if (trace(Ray(origin, frame * vec3(along, 0.0), push.radius), false, hit)) {
            steps = min(254u, uint(255.0 * hit.t / push.radius));
        }
        reach[sector >> 2] |= steps << (8u * (sector & 3u));
    }
    reaches[index] = reach;
    if (!loops_completed(push.end_point)) truncated_loops[0] = LOOP_TRUNCATED;
}
