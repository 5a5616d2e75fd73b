// Near-light correction, step 1: traces rays from the light, and from each hit a ray upwards, which
// measures the clearance of its surface. Deterministic: minima do not depend on the order. One
// invocation = one ray. In: rays. Out: hits; distance of the nearest one, and least clearance.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/near_lights.glsl"

layout(local_size_x = 64) in;

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer GlossyMaterials { uint glossy_materials[]; };  // 1: beams handle its light
layout(scalar, binding = 4) readonly buffer NearRays { NearRay near_rays[]; };
layout(scalar, binding = 5) writeonly buffer NearHits { NearHit near_hits[]; };
layout(scalar, binding = 6) buffer NearStates { NearState near_states[]; };  // one
layout(scalar, binding = 7) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { NearLightsPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.ray_count) return;
    NearRay ray = near_rays[index];
    NearHit near = NearHit(vec3(0.0), 0.0, vec3(0.0), 0.0, 0.0, 0.0);
    Hit hit;
    bool is_hit = trace(Ray(push.light_position, ray.direction, 1e30), false, hit);
    if (is_hit) {
        Surface surface = surface_at(hit.triangle);
        bool is_back = dot(surface.normal, ray.direction) > 0.0;
        if (side_is_active(surface.sides, is_back) && glossy_materials[surface.material] == 0u) {
            atomicMin(near_states[0].nearest, floatBitsToUint(hit.t));
            near.position = push.light_position + hit.t * ray.direction;
            near.distance = hit.t;
            near.normal = is_back ? -surface.normal : surface.normal;
            near.flux = hit.t < REACH * push.mean_spacing ? ray.flux : 0.0;
            near.flux *= passed_by_panes(Ray(push.light_position, ray.direction, hit.t), push.channel);
        }
    }
    if (near.flux > 0.0) {
        float over = OFF * push.spacing;
        bool is_covered = trace(Ray(near.position + over * near.normal, near.normal, 1e30), false, hit);
        near.clearance = OVER * push.spacing;
        if (is_covered) near.clearance = min(near.clearance, 0.5 * (hit.t + over));
        atomicMin(near_states[0].height, floatBitsToUint(near.clearance));
    }
    near_hits[index] = near;
    if (!loops_completed(push.ray_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
