// Shining pixels, step 3: traces rays into the Phong lobe towards the camera and keeps, for each, the cluster that it will read;
// everything but the light. Deterministic. One invocation = every so-many-th ray. In: shining pixels. Out: rays, pixel by pixel.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;

struct GlossRaysPush {
    Grid grid;
    vec3 eye;             // the camera, metres
    uint pixel_count;     // of the image
    uint most_rays;       // of a pixel
    uint capacity;        // rays that there is room for
    uint stride;          // invocations
    uint seed;
    uint cluster_bits;    // width of the cluster field in GlossRay.target
    float least_entry_points;  // clusters with fewer of them are not trusted
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 4) readonly buffer CellFirst { uint cell_first[]; };
layout(scalar, binding = 5) readonly buffer CellClusters { uint cell_clusters[]; };
layout(scalar, binding = 6) readonly buffer ClusterLinks { ClusterLink links[]; };
layout(scalar, binding = 7) readonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, binding = 8) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 9) readonly buffer GlossPixels { uint gloss_pixels[]; };
layout(scalar, binding = 10) writeonly buffer GlossRays { GlossRay gloss_rays[]; };
layout(scalar, push_constant) uniform Push { GlossRaysPush push; };

#include "include/bvh.glsl"
#include "include/grid.glsl"
#include "include/target.glsl"

// Ray number `number` of `rays` from a shining pixel.
GlossRay traced(PixelSurface pixel, uint number, uint rays, uint seed) {
    vec3 geometric = surfaces[pixel.side >> 1].normal;
    if ((pixel.side & 1u) != 0u) geometric = -geometric;
    float exponent = materials[surfaces[pixel.side >> 1].material].exponent;
    vec3 mirror = reflect(normalize(pixel.position - push.eye), pixel.normal);
    vec3 direction = sample_phong_lobe(mirror, exponent, sample_3d(number, seed).xy);
    float cosine = dot(direction, pixel.normal);

    GlossRay ray = GlossRay(NO_TARGET, 0.0, pack_direction(-direction));
    Hit hit;
    if (cosine > 0.0 && dot(direction, geometric) > 0.0
        && trace(Ray(offset_origin(pixel.position, geometric), direction, 1e30), false, hit)) {
        // The lobe's solid angle, 2π/(n+1), divided among its rays; half as wide, because they do not divide it evenly.
        float footprint = 0.5 * hit.t * sqrt(2.0 * PI / ((exponent + 1.0) * float(rays)));
        uint cluster = cluster_for(hit, direction, footprint);
        if (cluster != NO_CLUSTER) ray.target = cluster | (surfaces[hit.triangle].material << push.cluster_bits);
        ray.weight = cosine * (exponent + 2.0) / (exponent + 1.0);
    }
    return ray;
}

void main() {
    uint count = gloss_offsets[push.pixel_count];
    uint rays = rays_per_pixel(count, push.most_rays, push.capacity);
    for (uint index = flat_invocation(); index < count * rays; index += push.stride) {
        uint pixel = gloss_pixels[index / rays];
        gloss_rays[index] = traced(pixels[pixel], index % rays, rays, hash(push.seed, pixel));
    }
}
