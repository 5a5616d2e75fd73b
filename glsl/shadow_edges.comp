// Antialiasing of a light, step 3: at the pixels across which its light changes much, the mean of the light over samples
// spread over the pixel. On a flat surface they lie on the plane that its centre sees and take no camera ray; on a curved one
// that plane would hide them behind the surface. Deterministic. Sixteen invocations = one pixel.
// In: camera, scene, pixels, the light. Out: its layer at these pixels.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"

const uint LANES = 16u;  // that share a pixel

layout(local_size_x = 64) in;

struct ShadowEdgesPush {
    View view;
    uint most_samples;  // of a pixel
    uint capacity;      // samples that may be taken
    uint light;
    uint first_sample;  // of the light, in this dispatch; later ones add to what the first wrote
    uint end_sample;
    uint traces_all;    // 1: rays are traced although they cannot bring light
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer Lights { LightSource lights[]; };
layout(scalar, binding = 4) readonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, binding = 5) readonly buffer ShadowOffsets { uint shadow_offsets[]; };
layout(scalar, binding = 6) readonly buffer ShadowPixels { uint shadow_pixels[]; };
layout(scalar, binding = 7) buffer LightLayer { float light_layer[]; };
layout(scalar, push_constant) uniform Push { ShadowEdgesPush push; };

#include "include/bvh.glsl"
#include "include/primary.glsl"
#include "include/lights.glsl"
#include "include/direct.glsl"

shared float sums[64];

// Cosine between shading and geometric normal below which a surface is curved.
const float FLAT = 0.99999;

// Unit geometric normal of a side.
vec3 facing_normal(uint side) {
    vec3 normal = surfaces[side >> 1].normal;
    return (side & 1u) != 0u ? -normal : normal;
}

// Where the ray of an image point meets the plane that a pixel sees; the pixel's own position where it grazes that plane.
vec3 on_plane(View view, PixelSurface pixel, vec3 normal, vec2 point) {
    vec2 ndc = point / vec2(view.width, view.height) * 2.0 - 1.0;
    vec3 direction = view.forward + ndc.x * view.right - ndc.y * view.up;
    vec3 to_pixel = pixel.position - view.position;
    float depth = dot(to_pixel, view.forward);
    float t = dot(to_pixel, normal) / dot(direction, normal);
    return abs(t - depth) < 0.25 * depth ? view.position + t * direction : pixel.position;
}

void main() {
    View view = push.view;
    uint edge_count = shadow_offsets[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.most_samples, push.capacity);
    uint edge = flat_workgroup() * (64u / LANES) + gl_LocalInvocationIndex / LANES;
    uint lane = gl_LocalInvocationIndex % LANES;
    uint index = shadow_pixels[min(edge, max(edge_count, 1u) - 1u)];
    vec2 corner = vec2(index % view.width, index / view.width);
    float sum = 0.0;
    for (uint i = lane; i < count && edge < edge_count; i += LANES) {
        PixelSurface found = pixels[index];
        vec3 normal = facing_normal(found.side);
        vec2 point = corner + sample_3d(i, index).xy;
        bool is_curved = dot(found.normal, normal) < FLAT;
        if (!is_curved) found.position = on_plane(view, found, normal, point);
        // A loop that turns once or never, which lavapipe skips where a branch would be taken by all.
        for (bool is_due = is_curved; is_due; is_due = false) {
            found = seen_through(view, point);
            if (found.side != NO_SIDE) normal = facing_normal(found.side);
        }
        if (found.side == NO_SIDE) continue;
        sum += light_factor(lights[push.light], push.first_sample, push.end_sample, push.traces_all != 0u, found.position, normal, found.normal,
                            found.footprint);
    }
    sums[gl_LocalInvocationIndex] = sum;
    barrier();
    if (lane != 0u || edge >= edge_count || count == 0u) return;
    float total = 0.0;
    for (uint i = 0u; i < LANES; ++i) total += sums[gl_LocalInvocationIndex + i];
    light_layer[index] = (push.first_sample == 0u ? 0.0 : light_layer[index]) + total / float(count);
}
