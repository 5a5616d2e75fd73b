// Antialiasing of a light, step 5: the mean of the light over samples spread over a pixel, at
// the pixels of step 3. If one flat triangle fills the pixel, the samples are on its plane and
// take no camera ray; elsewhere that plane would hide them behind the surface. Edge pixels only
// lose their mark. Deterministic. Sixteen invocations = one pixel. In: camera, scene, pixels, the
// light. Out: the per-light irradiance buffer at these pixels.
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
#include "include/antialias.glsl"

#define SAMPLES_OF_PIXEL

const uint LANES = 16u;  // that share a pixel

layout(local_size_x = 64) in;

struct EdgeLightPush {
    View view;
    EdgeCapacity capacity;
    uint light;
    uint first_sample;  // first sample in this dispatch; later dispatches add to the first
    uint end_sample;
    uint sample_step;   // of the lattice of the samples of all image points of a pixel
    uint flags;         // TRACES_ALL, ADDS, MARKS_PENUMBRA
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Lights;
layout(scalar, binding = 4) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(binding = 5) uniform usamplerBuffer Pixels;
layout(scalar, binding = 6) readonly buffer ShadowGroups { uint shadow_groups[]; };
layout(scalar, binding = 7) readonly buffer ShadowPixels { uint shadow_pixels[]; };
layout(scalar, binding = 8) buffer LightIrradiance { float light_irradiance[]; };
layout(scalar, binding = 9) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeLightPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/lights.glsl"
#include "include/light_kind.glsl"
#include "include/direct.glsl"

shared float sums[64];

// Intersection of a camera ray with the plane of a pixel's surface; the pixel's own position if the
// ray grazes the plane.
vec3 on_plane(View view, PixelSurface pixel, vec3 normal, vec2 point) {
    vec3 direction = direction_through(view, point);
    vec3 to_pixel = pixel.position - view.position;
    float depth = dot(to_pixel, view.forward);
    float t = dot(to_pixel, normal) / dot(direction, normal);
    return abs(t - depth) < 0.25 * depth ? view.position + t * direction : pixel.position;
}

void main() {
    View view = push.view;
    uint listed = shadow_groups[3];
    uint place = flat_workgroup() * (64u / LANES) + gl_LocalInvocationIndex / LANES;
    uint lane = gl_LocalInvocationIndex % LANES;
    uint index = shadow_pixels[min(place, max(listed, 1u) - 1u)];
    bool is_edge = edge_numbers[index] != NO_EDGE;
    uint count = is_edge ? 0u : push.capacity.light_samples;
    vec2 corner = vec2(in_rows(index, view.width));
    float sum = 0.0;
    PixelSurface own = pixel_surface_at(Pixels, index);
    Surface own_surface = surface_at(own.side >> 1);
    vec3 own_normal = facet_of(own_surface, own.side);
    bool is_traced = is_sampled_by_rays(view, corner, own);
    LightSource whole_light = of_kind(light_at(Lights, push.light));
    uint end = end_of_kind(push.first_sample, push.end_sample);
    for (uint i = lane; i < count && place < listed; i += LANES) {
        PixelSurface found = own;
        vec2 point = corner + sample_3d(i, index).xy;
        if (!is_traced) found.position = on_plane(view, found, own_normal, point);
        if_any (is_traced) found = seen_through(view, point);
        if (found.side == NO_SIDE) continue;
        Receiver at = Receiver(found.position, own_normal);
        if_any (is_traced || (own_surface.sides & ROUNDED) != 0u) at = receiver_of(found);
        LightSource light = seen_from_point(whole_light, i, push.sample_step);
        float factor = light_factor(light, push.first_sample, end, push.flags, at.position, at.normal, found.normal, found.footprint);
        sum += light.relative * weighed(light, light.samples, factor, at.position, found.normal, found.footprint);
    }
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
    sums[gl_LocalInvocationIndex] = sum;
    barrier();
    if (lane != 0u || place >= listed) return;
    if (is_edge) {
        light_irradiance[index] = abs(light_irradiance[index]);
        return;
    }
    float total = 0.0;
    for (uint i = 0u; i < LANES; ++i) total += sums[gl_LocalInvocationIndex + i];
    float before = is_first(push.flags, push.first_sample) ? 0.0 : light_irradiance[index];
    light_irradiance[index] = before + total / float(count);
}
