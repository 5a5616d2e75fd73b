// Gather rays: traces the stratified hemisphere of every cache point. Each ray stores the cluster
// that it reads and its weight in the translational gradient; neither depends on light. [Yue §3,
// Figure 2; Krivanek] Deterministic. One workgroup = one cache point. In: cache points, scene,
// clusters. Out: gather rays (gradient weights in 1/min_distance).
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

layout(local_size_x_id = 3) in;
layout(constant_id = 0) const uint RINGS = 0;
layout(constant_id = 1) const uint SECTORS = 0;
layout(constant_id = 2) const uint SKY_SIDE = 0;  // of the sky's table; 0: rays out of the scene read nothing
layout(constant_id = 4) const uint HAS_MOVABLE = 0;  // 1: models can move; hits on all other surface are kept

struct GatherRaysPush {
    Grid grid;
    uint first_point;     // of this chunk
    uint first_row;       // of this chunk, in the bound buffer of the split table
    uint point_count;
    uint seed;
    uint cluster_bits;    // width of the number in GatherRay.target
    uint first_sky;       // number of the target of the sky's first cell
    float min_entry_points;  // minimum sample count of a cluster
    float min_distance; // lower bound of distances in gradients, metres
    float far_cells;      // least distance at which bright clusters are sampled apart, in base cells there
    vec3 movable_low;     // corners of the models that can move
    vec3 movable_high;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Octree { uint octree[]; };
layout(scalar, binding = 4) readonly buffer CellClusters { uint cell_clusters[]; };
layout(scalar, binding = 5) readonly buffer ClusterLinks { ClusterLink links[]; };
layout(scalar, binding = 6) readonly buffer UnweightedClusters { uint unweighted_clusters[]; };
layout(scalar, binding = 7) readonly buffer CachePoints { CachePoint cache_points[]; };
layout(scalar, binding = 8) buffer GatherRays { GatherRay gather_rays[]; };
layout(scalar, binding = 9) writeonly buffer RayColours { uint ray_colours[]; };  // of the image at the hit, packed
layout(scalar, binding = 10) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, binding = 11) readonly buffer HitRows { uint hit_rows[]; };  // of each cache point: its row in kept_hits, or NO_ROW
layout(scalar, binding = 12) buffer KeptHits { uint kept_hits[]; };  // triangle that each ray meets on surface that cannot move, or NO_HIT
layout(scalar, binding = 13) buffer TracedRays { uint traced_rays[]; };  // among triangles that cannot move, and others
layout(scalar, binding = 14) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 15) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 16) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { GatherRaysPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/grid.glsl"
#include "include/gather.glsl"
#include "include/target.glsl"
#include "include/textures.glsl"

const float FAR = 1e30;
// Width of the cells that rays read, in widths of a stratum. Light varies within a cell, and the
// rays do not sample it evenly.
const float SHARE = 0.25;
shared float distances[RINGS * SECTORS];

// 1 / distance to the nearer end of an edge between two strata, in units of 1/min_distance so that
// a half can hold it at any scale; zero where neither ray hit anything. Bounded because a record's
// radius is, too. [Krivanek]
float inverse_nearer(float a, float b) {
    float nearer = min(a, b);
    return nearer < FAR ? push.min_distance / max(nearer, push.min_distance) : 0.0;
}

float ring_sin2(uint ring) { return float(ring) / float(RINGS); }

// cos²θ sinθ on the lower edge of a ring.
float ring_edge(uint ring) { return (1.0 - ring_sin2(ring)) * sqrt(ring_sin2(ring)); }

// Weight of the ray's radiance in ∂E/∂(tangent, bitangent): the change of its stratum's solid
// angle as the edges to its four neighbours move. The gradient of stratified hemisphere sampling
// [Krivanek], with its terms regrouped by ray.
vec2 gradient_weight(Stratum s) {
    uint here = s.ring * SECTORS + s.sector;
    uint before = s.ring * SECTORS + (s.sector + SECTORS - 1u) % SECTORS;
    uint after = s.ring * SECTORS + (s.sector + 1u) % SECTORS;
    float t = distances[here];
    float width = 2.0 * PI / float(SECTORS);

    float outward = 0.0;
    if (s.ring > 0u) outward += ring_edge(s.ring) * inverse_nearer(t, distances[here - SECTORS]);
    if (s.ring + 1u < RINGS) outward -= ring_edge(s.ring + 1u) * inverse_nearer(t, distances[here + SECTORS]);

    float sin_middle = sqrt((float(s.ring) + 0.5) / float(RINGS));
    float cos_middle = sqrt(1.0 - (float(s.ring) + 0.5) / float(RINGS));
    // A device may divide n by n to a little more than 1.
    float height = sqrt(1.0 - ring_sin2(s.ring)) - sqrt(max(1.0 - ring_sin2(s.ring + 1u), 0.0));
    float around = cos_middle * height / sin_middle;

    float middle = (float(s.sector) + 0.5) * width;
    float low = float(s.sector) * width;
    float high = low + width;
    return width * outward * vec2(cos(middle), sin(middle))
         + around * inverse_nearer(t, distances[before]) * vec2(-sin(low), cos(low))
         - around * inverse_nearer(t, distances[after]) * vec2(-sin(high), cos(high));
}

const uint NO_ROW = 0xffffffffu;
const uint ROW_IS_KEPT = 0x80000000u;
const uint NO_HIT = 0x7fffffffu;
const uint IS_NEAR = 0x80000000u;  // flag of a triangle: models that can move may be nearer
// Roots of the two trees (src/scene/bvh.rs).
const uint STATIC_ROOT = 1u;
const uint MOVABLE_ROOT = 2u;

// A ray of the hemisphere of a cache point.
struct GatherDirection {
    vec3 direction;
    float cosine;     // to the shading normal
    bool is_outside;  // of the surface
};

GatherDirection direction_of(uint ray, CachePoint point, mat3 frame) {
    vec3 local = stratum_direction(stratum_of(ray), point.stream, push.seed);
    vec3 direction = frame * local;
    // If the shading normal leans away from the geometric one, part of its hemisphere lies
    // inside the surface.
    return GatherDirection(direction, local.z, dot(direction, point.facet) > 0.0);
}

// Writes what a ray of the row that begins at `first` reads. Returns the distance of its hit.
float write_target(uint first, uint ray, vec3 origin, GatherDirection found, bool is_hit, Hit hit) {
    uint target = NO_TARGET;
    float distance = FAR;
    vec3 direction = found.direction;
    if (is_hit) {
        distance = hit.t;
        // The solid angle of one stratum.
        float footprint = SHARE * sqrt(PI / (float(RINGS * SECTORS) * found.cosine)) * hit.t;
        float cells;
        uint cluster = cluster_for(hit, direction, footprint, cells);
        uint material = surface_at(hit.triangle).material;
        if (cluster != NO_CLUSTER) target = cluster | ((material << 1 | uint(cells > push.far_cells)) << push.cluster_bits);
        if (HAS_TEXTURES != 0u) ray_colours[first + ray] = pack_colour(passed_by_panes(Ray(origin, direction, hit.t)) * image_at(material, hit.triangle, hit.barycentric));
    } else if (SKY_SIDE != 0u && found.is_outside) {
        target = push.first_sky + octahedral_cell(direction, SKY_SIDE);
        if (HAS_TEXTURES != 0u) ray_colours[first + ray] = pack_colour(passed_by_panes(Ray(origin, direction, FAR)));
    }
    gather_rays[first + ray].target = target;
    return distance;
}

// The hit of a ray with one triangle. Whether a walk found the triangle or an earlier walk did, the
// hit has the same bits.
bool meets_triangle(uint triangle, vec3 origin, vec3 direction, out Hit hit) {
    hit = Hit(FAR, 0u, vec3(0.0));
    return triangle != NO_HIT && intersect_triangle(triangle, origin, shear_along(without_zeros(direction)), false, hit);
}

// Whether a ray comes near models that can move before it ends.
bool nears_movable(vec3 origin, vec3 direction, float t) {
    vec3 slack = vec3(1e-5 * largest_of(push.movable_high - push.movable_low) + scene_clear_distance());
    vec3 inverse = 1.0 / without_zeros(direction);
    vec3 a = (push.movable_low - slack - origin) * inverse;
    vec3 b = (push.movable_high + slack - origin) * inverse;
    float enter = max(largest_of(min(a, b)), 0.0);
    vec3 leave = max(a, b);
    return enter <= min(min(leave.x, leave.y), min(leave.z, t));
}

void main() {
    uint local_point = flat_workgroup();
    if (local_point >= push.point_count) return;
    uint index = push.first_point + local_point;
    CachePoint point = cache_points[index];
    vec3 origin = offset_origin(point.position, point.facet);
    mat3 frame = frame_around(point.normal);
    uint first = (push.first_row + local_point) * RINGS * SECTORS;

    if (HAS_MOVABLE == 0u) {
        for (uint ray = gl_LocalInvocationIndex; ray < RINGS * SECTORS; ray += gl_WorkGroupSize.x) {
            GatherDirection ahead = direction_of(ray, point, frame);
            Hit hit;
            bool is_hit = ahead.is_outside && trace(Ray(origin, ahead.direction, FAR), false, hit);
            distances[ray] = write_target(first, ray, origin, ahead, is_hit, hit);
        }
    } else {
        // The triangle that each ray meets takes the place of its target until the end.
        uint row = hit_rows[index];
        bool is_kept = row != NO_ROW && (row & ROW_IS_KEPT) != 0u;
        uint first_hit = (row & ~ROW_IS_KEPT) * RINGS * SECTORS;
        uint fixed_rays = 0u;
        uint movable_rays = 0u;
        for (uint ray = gl_LocalInvocationIndex; ray < RINGS * SECTORS; ray += gl_WorkGroupSize.x) {
            GatherDirection ahead = direction_of(ray, point, frame);
            uint triangle = NO_HIT;
            Hit hit;
            if (is_kept) {
                triangle = kept_hits[first_hit + ray];
            } else if (ahead.is_outside) {
                if (trace_from(STATIC_ROOT, Nodes, 0u, 0u, Ray(origin, ahead.direction, FAR), false, hit)) triangle = hit.triangle;
                ++fixed_rays;
            }
            if (row != NO_ROW && !is_kept) kept_hits[first_hit + ray] = triangle;
            bool is_hit = meets_triangle(triangle, origin, ahead.direction, hit);
            bool is_near = ahead.is_outside && nears_movable(origin, ahead.direction, is_hit ? hit.t : FAR);
            gather_rays[first + ray].target = triangle | (is_near ? IS_NEAR : 0u);
        }
        // Few rays come near models that can move. The lanes look for theirs first, and trace them
        // side by side.
        uint ray = gl_LocalInvocationIndex;
        while (true) {
            while (ray < RINGS * SECTORS && (gather_rays[first + ray].target & IS_NEAR) == 0u) ray += gl_WorkGroupSize.x;
            if (ray >= RINGS * SECTORS) break;
            GatherDirection ahead = direction_of(ray, point, frame);
            uint triangle = gather_rays[first + ray].target & ~IS_NEAR;
            Hit hit;
            meets_triangle(triangle, origin, ahead.direction, hit);
            if (trace_from(MOVABLE_ROOT, Nodes, 0u, 0u, Ray(origin, ahead.direction, hit.t), false, hit)) triangle = hit.triangle;
            gather_rays[first + ray].target = triangle;
            ++movable_rays;
        }
        for (uint ray = gl_LocalInvocationIndex; ray < RINGS * SECTORS; ray += gl_WorkGroupSize.x) {
            GatherDirection ahead = direction_of(ray, point, frame);
            Hit hit;
            bool is_hit = meets_triangle(gather_rays[first + ray].target, origin, ahead.direction, hit);
            distances[ray] = write_target(first, ray, origin, ahead, is_hit, hit);
        }
        atomicAdd(traced_rays[0], fixed_rays);
        atomicAdd(traced_rays[1], movable_rays);
    }
    barrier();
    for (uint ray = gl_LocalInvocationIndex; ray < RINGS * SECTORS; ray += gl_WorkGroupSize.x) {
        gather_rays[first + ray].gradient = packHalf2x16(gradient_weight(stratum_of(ray)));
    }
    if (!loops_completed(push.point_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
