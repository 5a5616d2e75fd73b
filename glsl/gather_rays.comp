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
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Octree { uint octree[]; };
layout(scalar, binding = 4) readonly buffer CellClusters { uint cell_clusters[]; };
layout(scalar, binding = 5) readonly buffer ClusterLinks { ClusterLink links[]; };
layout(scalar, binding = 6) readonly buffer UnweightedClusters { uint unweighted_clusters[]; };
layout(scalar, binding = 7) readonly buffer CachePoints { CachePoint cache_points[]; };
layout(scalar, binding = 8) writeonly buffer GatherRays { GatherRay gather_rays[]; };
layout(scalar, binding = 9) writeonly buffer RayColours { uint ray_colours[]; };  // of the image at the hit, packed
layout(scalar, binding = 10) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, binding = 11) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 12) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 13) readonly buffer Texels { uint texels[]; };
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

void main() {
    uint local_point = flat_workgroup();
    if (local_point >= push.point_count) return;
    uint index = push.first_point + local_point;
    CachePoint point = cache_points[index];
    vec3 origin = offset_origin(point.position, point.facet);
    mat3 frame = frame_around(point.normal);
    uint first = (push.first_row + local_point) * RINGS * SECTORS;

    for (uint ray = gl_LocalInvocationIndex; ray < RINGS * SECTORS; ray += gl_WorkGroupSize.x) {
        vec3 local = stratum_direction(stratum_of(ray), point.stream, push.seed);
        vec3 direction = frame * local;
        uint target = NO_TARGET;
        float distance = FAR;
        Hit hit;
        // If the shading normal leans away from the geometric one, part of its hemisphere lies
        // inside the surface.
        bool is_outside = dot(direction, point.facet) > 0.0;
        if (is_outside && trace(Ray(origin, direction, FAR), false, hit)) {
            distance = hit.t;
            // The solid angle of one stratum.
            float footprint = SHARE * sqrt(PI / (float(RINGS * SECTORS) * local.z)) * hit.t;
            float cells;
            uint cluster = cluster_for(hit, direction, footprint, cells);
            uint material = surface_at(hit.triangle).material;
            if (cluster != NO_CLUSTER) target = cluster | ((material << 1 | uint(cells > push.far_cells)) << push.cluster_bits);
            if (HAS_TEXTURES != 0u) ray_colours[first + ray] = pack_colour(passed_by_panes(Ray(origin, direction, hit.t)) * image_at(material, hit.triangle, hit.barycentric));
        } else if (SKY_SIDE != 0u && is_outside) {
            target = push.first_sky + octahedral_cell(direction, SKY_SIDE);
            if (HAS_TEXTURES != 0u) ray_colours[first + ray] = pack_colour(passed_by_panes(Ray(origin, direction, FAR)));
        }
        distances[ray] = distance;
        gather_rays[first + ray].target = target;
    }
    barrier();
    for (uint ray = gl_LocalInvocationIndex; ray < RINGS * SECTORS; ray += gl_WorkGroupSize.x) {
        gather_rays[first + ray].gradient = packHalf2x16(gradient_weight(stratum_of(ray)));
    }
    if (!loops_completed(push.point_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
