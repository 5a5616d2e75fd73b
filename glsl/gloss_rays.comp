// Glossy pixels, step 4: traces rays from each sample into its Phong lobe, unless records bring its
// light, and stores the clusters that they read; nothing stored depends on light. Deterministic.
// One invocation = every `stride`th sample. In: samples. Out: rays, sample by sample.
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
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/gloss_rays.glsl"
#include "include/directions.glsl"
#include "include/colour.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint TRACES = 1;  // 0: no ray is traced into a lobe

struct GlossRaysPush {
    Grid grid;
    vec3 eye;                  // the camera, metres
    uint pixel_count;          // of the image
    uint max_samples;         // of a pixel
    uint capacity;             // of the list of samples
    uint stride;               // invocations
    uint seed;
    uint cluster_bits;         // width of the cluster field in GlossRay.target
    float min_entry_points;  // minimum sample count of a cluster
    uint broad_exponents;     // see `is_broad`
    uint side;                 // direction bins along an edge of the square map
    float max_exponent;       // of a lobe that the bins resolve
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 4) readonly buffer Octree { uint octree[]; };
layout(scalar, binding = 5) readonly buffer CellClusters { uint cell_clusters[]; };
layout(scalar, binding = 6) readonly buffer ClusterLinks { ClusterLink links[]; };
layout(scalar, binding = 7) readonly buffer UnweightedClusters { uint unweighted_clusters[]; };
layout(scalar, binding = 8) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 9) readonly buffer GlossPixels { uint gloss_pixels[]; };
layout(scalar, binding = 10) readonly buffer GlossSamples { PixelSurface gloss_samples[]; };
layout(scalar, binding = 11) writeonly buffer GlossRays { GlossRay gloss_rays[]; };
layout(scalar, binding = 12) writeonly buffer GlossColours { uint gloss_colours[]; };  // of the image at each ray's hit, packed
layout(scalar, binding = 13) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, binding = 14) readonly buffer ReadOffsets { uint read_offsets[]; };  // CSR offsets into `bin_reads`: one for each cluster, and the end
layout(scalar, binding = 15) readonly buffer BinReads { uvec2 bin_reads[]; };   // (direction bin, gloss bin), sorted
layout(scalar, binding = 16) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 17) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 18) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { GlossRaysPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/grid.glsl"
#include "include/target.glsl"
#include "include/textures.glsl"

uint material_of(uint side) { return surface_at(side >> 1).material; }

// A ray looks for a gloss bin first at a cluster of this fraction of its footprint, because gather
// rays may read finer clusters.
const float FINER = 0.25;
// Levels that the search climbs from there.
const uint CLIMB = 5u;

// The gloss bin that holds the outgoing flux of a cluster, or of one of its ancestors, in the bin
// of a direction; NO_GLOSS_BIN if there is none.
uint gloss_bin_towards(uint cluster, vec3 toward) {
    uint bin = direction_bin(toward, push.side);
    for (uint level = 0u; level <= CLIMB && cluster != NO_CLUSTER; ++level) {
        uvec2 range = uvec2(read_offsets[cluster], read_offsets[cluster + 1u]);
        while (range.x < range.y) {
            uint middle = (range.x + range.y) / 2u;
            uvec2 read = bin_reads[middle];
            if (read.x == bin) return read.y;
            if (read.x < bin) range.x = middle + 1u; else range.y = middle;
        }
        cluster = links[cluster].parent;
    }
    return NO_GLOSS_BIN;
}

// Ray number `index`, from a point that the camera sees; `rays` of them share the pixel's lobe.
GlossRay traced(uint index, PixelSurface point, vec2 u, uint rays) {
    vec3 geometric = surface_at(point.side >> 1).normal;
    if ((point.side & 1u) != 0u) geometric = -geometric;
    float exponent = materials[material_of(point.side)].exponent;
    vec3 mirror = reflect(normalize(point.position - push.eye), point.normal);
    vec3 direction = sample_phong_lobe(mirror, exponent, u);
    float cosine = dot(direction, point.normal);

    GlossRay ray = GlossRay(NO_TARGET, 0.0, pack_direction(-direction), NO_GLOSS_BIN);
    Hit hit;
    vec3 origin = offset_origin(point.position, geometric);
    if (cosine > 0.0 && dot(direction, geometric) > 0.0 && trace(Ray(origin, direction, 1e30), false, hit)) {
        // The lobe's solid angle, 2π/(n+1), divided among its rays; half as wide, because they do
        // not divide it evenly.
        float footprint = 0.5 * hit.t * sqrt(2.0 * PI / ((exponent + 1.0) * float(rays)));
        uint cluster = cluster_for(hit, direction, footprint);
        uint material = surface_at(hit.triangle).material;
        if (cluster != NO_CLUSTER) ray.target = cluster | (material << push.cluster_bits);
        bool reads_bins = has_lobe(materials[material]) && materials[material].exponent <= push.max_exponent
                        && gloss_fraction(materials[material]) <= LITTLE;
        if (reads_bins && cluster != NO_CLUSTER) ray.gloss_bin = gloss_bin_towards(cluster_for(hit, direction, FINER * footprint), -direction);
        if (HAS_TEXTURES != 0u) gloss_colours[index] = pack_colour(passed_by_panes(Ray(origin, direction, hit.t)) * image_at(material, hit.triangle, hit.barycentric));
        ray.weight = cosine * (exponent + 2.0) / (exponent + 1.0);
    }
    return ray;
}

void main() {
    GlossCounts counts = gloss_counts(gloss_offsets[push.pixel_count], gloss_offsets[2u * push.pixel_count], push.max_samples, push.capacity);
    for (uint index = flat_invocation(); index < counts.pixels.x * counts.samples.x; index += push.stride) {
        uvec3 owner = owner_of_sample(counts, index);
        uint seed = hash(push.seed, gloss_pixels[owner.y]);
        PixelSurface point = gloss_samples[index];
        Reflectance material = materials[material_of(point.side)];
        bool is_traced = TRACES == 1u && has_lobe(material) && !is_broad(material, push.broad_exponents);
        for (uint i = index * LOBE_RAYS; i < (index + 1u) * LOBE_RAYS; ++i) {
            vec2 u = sample_3d(owner.x * LOBE_RAYS + i % LOBE_RAYS, seed).xy;
            gloss_rays[i] = GlossRay(NO_TARGET, 0.0, 0u, NO_GLOSS_BIN);
            if (is_traced) gloss_rays[i] = traced(i, point, u, owner.z * LOBE_RAYS);
        }
    }
    if (!loops_completed(push.stride)) truncated_loops[0] = LOOP_TRUNCATED;
}
