// Irradiance at cache points by path tracing, from surfaces and from the sky without its bright
// spots: an exact reference for the gather pass. [Kajiya 1986] Deterministic. One invocation =
// STRATA strata of the points' gather hemispheres, one after another, so that few lanes wait for a
// neighbour's longest path. A dispatch extends the paths by `rounds` vertices. In: cache points,
// scene, lights, radiance of the sky (W/m²/sr). In and out: the paths and their accumulated
// radiance (W/m²/sr), one segment a cache point.
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
#include "include/colour.glsl"
#include "include/octahedral.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint RINGS = 0;
layout(constant_id = 1) const uint SECTORS = 0;
layout(constant_id = 2) const uint ROULETTE_THRESHOLD = 0;  // float bits: roulette starts below this throughput
layout(constant_id = 3) const uint STRATA = 0;  // of an invocation
layout(constant_id = 4) const uint SKY_SIDE = 0;  // of the sky's table; 0: no sky

// A path in progress, and the radiance of the finished ones.
struct ProbePath {
    vec3 origin;
    vec3 direction;
    vec3 throughput;    // product of brdf·cosθ/pdf since the first hit, roulette included
    vec3 radiance;      // sum over the paths, W/m²/sr
    uint depth;         // vertices so far; 0: starts at the cache point
    uint sample_index;  // index of its random numbers: the number of finished paths
};
struct IrradianceProbePush {
    uint first_point;
    uint point_count;
    uint light_count;
    uint seed;              // of the paths
    uint gather_seed;       // of the gather rays
    uint has_gather_rays;   // 1: paths start along the gather rays; 0: each in a new direction of the stratum
    uint goal;              // paths of each stratum
    uint rounds;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 4) uniform usamplerBuffer Lights;
layout(scalar, binding = 5) readonly buffer CachePoints { CachePoint cache_points[]; };
layout(scalar, binding = 6) buffer ProbePaths { ProbePath probe_paths[]; };
layout(scalar, binding = 7) buffer Unfinished { uint unfinished[]; };  // number of invocations that have not reached the goal; or LOOP_TRUNCATED
layout(scalar, binding = 8) readonly buffer SkyRadiance { vec3 sky_radiance[]; };
layout(scalar, binding = 9) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 10) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 11) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { IrradianceProbePush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_parts.glsl"
#include "include/brdf.glsl"
#include "include/textures.glsl"
#include "include/path.glsl"
#include "include/gather.glsl"

const float FAR = 1e30;

void main() {
    uint all = push.point_count * RINGS * SECTORS;
    uint stride = (all + STRATA - 1u) / STRATA;
    uint stratum = flat_invocation();
    if (stratum >= stride) return;
    bool is_along_gather_ray = push.has_gather_rays != 0u;

    ProbePath path = probe_paths[stratum];
    uint rays = 0u;
    for (uint round = 0u; round < push.rounds; ++round) {
        while (path.sample_index == push.goal && stratum + stride < all) {
            probe_paths[stratum] = path;
            stratum += stride;
            path = probe_paths[stratum];
        }
        if (path.sample_index == push.goal) break;
        uint index = push.first_point + stratum / (RINGS * SECTORS);
        uint ray = stratum % (RINGS * SECTORS);
        uint point_seed = hash(push.seed, index);
        uint ray_seed = hash(point_seed, ray);
        bool alive = true;
        if_any (path.depth == 0u) {
            CachePoint point = cache_points[index];
            uint name = is_along_gather_ray ? point.stream : path.sample_index;
            uint seed = is_along_gather_ray ? push.gather_seed : point_seed;
            path.origin = offset_origin(point.position, point.facet);
            path.direction = frame_around(point.normal) * stratum_direction(stratum_of(ray), name, seed);
            path.throughput = vec3(1.0);
            // If the shading normal leans away from the geometric one, part of its hemisphere lies
            // inside the surface.
            alive = dot(path.direction, point.facet) > 0.0;
        }
        Hit hit;
        bool is_outside = alive;
        alive = alive && trace(Ray(path.origin, path.direction, FAR), false, hit);
        path.throughput *= passed_by_panes(Ray(path.origin, path.direction, alive ? hit.t : FAR));
        if (SKY_SIDE != 0u && is_outside && !alive && path.depth == 0u) path.radiance += path.throughput * sky_radiance[octahedral_cell(path.direction, SKY_SIDE)];
        if (alive) {
            Vertex vertex = vertex_at(hit, path.direction, false);
            uint seed = hash(ray_seed, path.depth + 1u);
            vec3 gathered;
            path.radiance += path.throughput * reflected_light(vertex, path.sample_index, seed, rays, gathered);
            vec3 u = sample_3d(path.sample_index, seed);
            alive = reflect_path(vertex, u, uintBitsToFloat(ROULETTE_THRESHOLD), path.throughput, path.direction);
            path.origin = offset_origin(vertex.position, vertex.geometric);
            ++path.depth;
        }
        if (!alive) {
            ++path.sample_index;
            path.depth = 0u;
        }
    }
    probe_paths[stratum] = path;
    if (path.sample_index != push.goal || stratum + stride < all) atomicAdd(unfinished[0], 1u);
    if (!loops_completed(push.rounds)) atomicOr(unfinished[0], LOOP_TRUNCATED);
}
