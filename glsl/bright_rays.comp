// Bright clusters, step 3: adds their light to records, by shadow rays to points that are selected
// in proportion to the light that they reflect. Gather rays have left this light out. [Veach §9,
// sampling of lights; numerics: bright clusters] Deterministic. BRIGHT_LANES invocations = one
// listed cache point. In: cache points, bright clusters, flux (W). Out: added to records.
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
#include "include/hvds.glsl"
#include "include/bright.glsl"

layout(local_size_x = 64) in;

struct BrightRaysPush {
    uint record_count;  // of all, listed or not
    uint base_count;    // clusters without children, which come first
    uint rays;          // of a record, a multiple of BRIGHT_LANES
    uint seed;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Materials;
layout(binding = 4) uniform usamplerBuffer CachePoints;
layout(binding = 5) uniform usamplerBuffer ClusterFluxes;
layout(scalar, binding = 6) readonly buffer ChildOffsets { uint child_offsets[]; };
layout(scalar, binding = 7) readonly buffer Children { uint children[]; };
layout(scalar, binding = 8) readonly buffer BrightClusters { BrightCluster bright_clusters[]; };
layout(scalar, binding = 9) readonly buffer BrightSites { BrightSite sites[]; };  // of base clusters
layout(scalar, binding = 10) readonly buffer BrightStates { BrightState bright_state[]; };
layout(scalar, binding = 11) readonly buffer RecordOffsets { uint record_offsets[]; };  // exclusive prefix sum over the records, and the total
layout(scalar, binding = 12) readonly buffer ListedRecords { uint listed_records[]; };
layout(scalar, binding = 13) buffer Records { Record records[]; };
layout(scalar, binding = 14) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, binding = 15) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 16) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 17) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { BrightRaysPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/textures.glsl"

// Irradiance, and its gradients along tangent and bitangent.
struct Sum {
    vec3 irradiance;
    vec3 movement_x;
    vec3 movement_y;
    vec3 rotation_x;
    vec3 rotation_y;
};
const Sum NOTHING = Sum(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
shared Sum sums[64];

// Number in the list of the bright cluster whose part of all weights contains a place.
uint bright_at(uint place, uint count) {
    uint low = 0u, high = count - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (bright_clusters[middle].end <= place) low = middle + 1u;
        else high = middle;
    }
    return low;
}

float light_of(uint cluster) { return brightness(cluster_flux_at(ClusterFluxes, cluster).direct); }

// Descends to a base cluster, in proportion to direct light. `along`: uniform in [0, 1). `chance`
// is multiplied by the probability of the way.
uint descend(uint cluster, float along, inout float chance) {
    while (cluster >= push.base_count) {
        uint first = child_offsets[cluster - push.base_count], end = child_offsets[cluster - push.base_count + 1u];
        float whole = 0.0;
        for (uint i = first; i < end; ++i) whole += light_of(children[i]);
        float left = along * whole, light = 0.0;
        uint next = cluster;
        // Rounding may leave a rest behind the last child: the last one with light takes it.
        for (uint i = first; i < end && !(next != cluster && left < 0.0); ++i) {
            float own = light_of(children[i]);
            if (own <= 0.0) continue;
            next = children[i];
            light = own;
            left -= own;
        }
        if (next == cluster) return NO_CLUSTER;
        along = clamp((left + light) / light, 0.0, 0.99999994);
        chance *= light / whole;
        cluster = next;
    }
    return cluster;
}

// Adds the light of a base cluster, divided by the probability of its selection.
void add_ray(inout Sum sum, CachePoint point, mat3 frame, uint cluster, float chance) {
    BrightSite site = sites[cluster];
    vec3 origin = offset_origin(point.position, point.facet);
    Surface surface = surface_at(site.side >> 1);
    vec3 facet = facet_of(surface, site.side);
    vec3 to_site = offset_origin(site.position, facet) - origin;
    float squared = dot(to_site, to_site);
    float cos_here = dot(point.normal, to_site), cos_there = -dot(facet, to_site);
    // Shorter gather rays have read the cluster.
    if (squared <= site.reach * site.reach || cos_here <= 0.0 || cos_there <= 0.0 || dot(point.facet, to_site) <= 0.0) return;
    Ray ray = Ray(origin, to_site, 1.0);
    Hit hit;
    if (trace(ray, true, hit)) return;

    vec3 flux = reflectance_at(Materials, surface.material).diffuse * cluster_flux_at(ClusterFluxes, cluster).direct
              / (PI * chance * float(push.rays)) * passed_by_panes(ray);
    if (HAS_TEXTURES != 0u) flux *= image_at(surface.material, site.side >> 1, barycentric_at(site.side >> 1, site.position));
    float inverse = 1.0 / squared;
    float factor = cos_here * cos_there * inverse * inverse;
    vec3 movement = (facet * cos_here - point.normal * cos_there) * inverse * inverse + 4.0 * factor * inverse * to_site;
    vec3 rotation = cos_there * inverse * inverse * to_site;
    sum.irradiance += factor * flux;
    sum.movement_x += dot(frame[0], movement) * flux;
    sum.movement_y += dot(frame[1], movement) * flux;
    sum.rotation_x += dot(frame[0], rotation) * flux;
    sum.rotation_y += dot(frame[1], rotation) * flux;
}

void main() {
    BrightState bright = bright_state[0];
    uint place = flat_invocation() / BRIGHT_LANES;
    uint lane = gl_LocalInvocationIndex % BRIGHT_LANES;
    bool is_listed = place < record_offsets[push.record_count];
    uint index = is_listed ? listed_records[place] : 0u;
    CachePoint point = cache_point_at(CachePoints, index);
    mat3 frame = frame_around(point.normal);

    Sum sum = NOTHING;
    uint stratum = bright.weight / push.rays;
    for (uint ray = lane; ray < (is_listed ? push.rays : 0u); ray += BRIGHT_LANES) {
        vec2 along = sample_3d(point.stream, hash(ray, push.seed)).xy;
        uint number = bright_at(ray * stratum + min(uint(along.x * float(stratum)), stratum - 1u), bright.count);
        uint before = number == 0u ? 0u : bright_clusters[number - 1u].end;
        float chance = float(bright_clusters[number].end - before) / float(bright.weight);
        uint cluster = descend(bright_clusters[number].cluster, along.y, chance);
        if (cluster != NO_CLUSTER) add_ray(sum, point, frame, cluster, chance);
    }
    // The lanes of a record, in order.
    sums[gl_LocalInvocationIndex] = sum;
    barrier();
    if (!is_listed || lane != 0u) return;
    for (uint i = 1u; i < BRIGHT_LANES; ++i) {
        Sum other = sums[gl_LocalInvocationIndex + i];
        sum = Sum(sum.irradiance + other.irradiance, sum.movement_x + other.movement_x, sum.movement_y + other.movement_y,
                  sum.rotation_x + other.rotation_x, sum.rotation_y + other.rotation_y);
    }
    records[index].irradiance += sum.irradiance;
    records[index].translation += outerProduct(frame[0], sum.movement_x) + outerProduct(frame[1], sum.movement_y);
    records[index].rotation += outerProduct(frame[0], sum.rotation_x) + outerProduct(frame[1], sum.rotation_y);
    if (!loops_completed(push.record_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
