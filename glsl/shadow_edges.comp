// Antialiasing of a light, step 3: the mean of the light over samples spread over a pixel, at
// the pixels of step 2. If one flat triangle fills the pixel, the samples are on its plane and
// take no camera ray; elsewhere that plane would hide them behind the surface. Edge pixels get
// their further samples here, each in the most similar slot. Deterministic. Sixteen
// invocations = one pixel. In: camera, scene, pixels, the light. Out: the per-light irradiance
// buffer at these pixels.
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
#include "include/records.glsl"

#define SAMPLES_OF_PIXEL

const uint LANES = 16u;  // that share a pixel

layout(local_size_x = 64) in;

struct EdgeLightPush {
    View view;
    EdgeCapacity capacity;
    uint light;
    uint first_sample;  // first sample of an image point in this dispatch; later dispatches add to the first
    uint end_sample;
    uint sample_step;   // of the lattice of the samples of all image points of a pixel
    uint flags;         // TRACES_ALL: camera rays start at the tree's root, too; ADDS
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer Lights;
layout(scalar, binding = 4) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(binding = 5) uniform usamplerBuffer Pixels;
layout(scalar, binding = 6) readonly buffer ShadowGroups { uint shadow_groups[]; };
layout(scalar, binding = 7) readonly buffer ShadowPixels { uint shadow_pixels[]; };
layout(binding = 8) uniform usamplerBuffer ShaftRoots;
layout(scalar, binding = 9) readonly buffer EdgeSlots { EdgeSlot edge_slots[]; };
layout(scalar, binding = 10) readonly buffer EdgeNeeds { uint edge_needs[]; };
layout(scalar, binding = 11) buffer LightIrradiance { float light_irradiance[]; };
layout(scalar, binding = 12) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(binding = 13) uniform usamplerBuffer EdgePoints;
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
#include "include/alike.glsl"
#include "include/shafts.glsl"

shared vec4 sums[64];

// Intersection of a camera ray with the plane of a pixel's surface; the pixel's own position if the
// ray grazes the plane.
vec3 on_plane(View view, PixelSurface pixel, vec3 normal, vec2 point) {
    vec3 direction = direction_through(view, point);
    vec3 to_pixel = pixel.position - view.position;
    float depth = dot(to_pixel, view.forward);
    float t = dot(to_pixel, normal) / dot(direction, normal);
    return abs(t - depth) < 0.25 * depth ? view.position + t * direction : pixel.position;
}

// Surface behind an image point, by a ray from the roots of a pixel's frustum; `place` is the
// pixel's index in the list.
PixelSurface seen_in(uint place, View view, vec2 point) {
    uint first = place * SHAFT_WORDS;
    uint counts = 1u << 16;
    bool has_roots = (push.flags & TRACES_ALL) == 0u && place < frusta_in(push.capacity);
    if (has_roots) counts = word_at(ShaftRoots, first);
    Ray ray = Ray(view.position, direction_through(view, point), 1e30);
    Shear shear = shear_along(without_zeros(ray.direction));
    Hit hit = Hit(ray.t_max, 0u, vec3(0.0));
    for (uint i = 0u; i < (counts & 0xffffu); ++i) intersect_triangle(word_at(ShaftRoots, first + 1u + i), ray.origin, shear, hit);
    // Nodes are stored at the end.
    uint nodes = counts >> 16;
    uint last = first + MAX_ROOTS;
    if_any (nodes != 0u) {
        uint root = has_roots ? word_at(ShaftRoots, last) : 0u;
        Hit below;
        if (trace_from(root, ShaftRoots, last + 1u - nodes, nodes - 1u, Ray(ray.origin, ray.direction, hit.t), false, below)) hit = below;
    }
    return hit.t < ray.t_max ? seen_at(view, ray.direction, hit) : NOTHING_SEEN;
}

// The slot of a further sample of an edge pixel: the least dissimilar one, of the sample's material
// if there is one. `first` is the pixel's first slot.
uint slot_for(PixelSurface found, uint pixel, uint first, uint slot_count) {
    uvec2 size = uvec2(push.view.width, push.view.height);
    Surface surface = surface_at(found.side >> 1);
    vec3 facet = facet_of(surface, found.side);
    uint best = 0u;
    float least = 1e30;
    for (uint i = 0u; i < slot_count; ++i) {
        EdgeSlot slot = edge_slots[first + i];
        if (slot.side == NO_SIDE) break;
        PixelSurface shown = pixel_surface_at(Pixels, pixel_at(size, pixel, place_of(slot)));
        if (slot.point != NO_POINT) shown = pixel_surface_at(EdgePoints, slot.point);
        float cost = dissimilarity(found, facet, shown);
        if (surface.material != surface_at(slot.side >> 1).material) cost += 1e6;
        best = cost < least ? i : best;
        least = min(cost, least);
    }
    return best;
}

void main() {
    View view = push.view;
    uint pixel_count = view.width * view.height;
    uint listed = shadow_groups[3];
    uint place = flat_workgroup() * (64u / LANES) + gl_LocalInvocationIndex / LANES;
    uint lane = gl_LocalInvocationIndex % LANES;
    uint index = shadow_pixels[min(place, max(listed, 1u) - 1u)];
    uint edge = edge_numbers[index];
    bool is_edge = edge != NO_EDGE;
    // Index of the first sample, end of the samples, and the slots of an edge pixel.
    uint before = 0u;
    uint count = samples_per_edge(listed, push.capacity);
    uint slots = slots_per_edge(edge_numbers[pixel_count], push.capacity);
    uint first_slot = edge * slots;
    if (is_edge) {
        before = samples_per_edge(edge_numbers[pixel_count], push.capacity);
        count = edge_needs[edge];
    }
    vec2 corner = vec2(in_rows(index, view.width));
    vec4 sum = vec4(0.0);
    PixelSurface own = pixel_surface_at(Pixels, index);
    Surface own_surface = surface_at(own.side >> 1);
    vec3 own_normal = facet_of(own_surface, own.side);
    bool is_traced = is_edge || is_sampled_by_rays(view, corner, own);
    LightSource whole_light = of_kind(light_at(Lights, push.light));
    uint end = end_of_kind(push.first_sample, push.end_sample);
    for (uint i = before + lane; i < count && place < listed; i += LANES) {
        PixelSurface found = own;
        vec2 point = corner + sample_3d(i, index).xy;
        if (!is_traced) found.position = on_plane(view, found, own_normal, point);
        if_any (is_traced) found = seen_in(place, view, point);
        if (found.side == NO_SIDE) continue;
        Receiver at = Receiver(found.position, own_normal);
        if_any (is_traced || (own_surface.sides & ROUNDED) != 0u) at = receiver_of(found);
        LightSource light = seen_from_point(whole_light, i, push.sample_step);
        float factor = light_factor(light, push.first_sample, end, push.flags, at.position, at.normal, found.normal, found.footprint);
        factor = light.relative * weighed(light, light.samples, factor, at.position, found.normal, found.footprint);
        uint slot = 0u;
        if_any (is_edge && factor > 0.0) slot = slot_for(found, index, first_slot, slots);
        sum += mix(vec4(0.0), vec4(factor), equal(uvec4(0u, 1u, 2u, 3u), uvec4(slot)));
    }
    if (!loops_completed(view.width)) truncated_loops[0] = LOOP_TRUNCATED;
    sums[gl_LocalInvocationIndex] = sum;
    barrier();
    if (lane != 0u || place >= listed) return;
    // Without samples, a pixel keeps its light, without the mark.
    if (!is_edge && count == 0u) light_irradiance[index] = abs(light_irradiance[index]);
    if (count == 0u) return;
    vec4 total = vec4(0.0);
    for (uint i = 0u; i < LANES; ++i) total += sums[gl_LocalInvocationIndex + i];
    bool starts = is_first(push.flags, push.first_sample);
    if (!is_edge) {
        float before_part = starts ? 0.0 : light_irradiance[index];
        light_irradiance[index] = before_part + total.x / float(count);
        return;
    }
    for (uint i = 0u; i < slots; ++i) {
        uint value = pixel_count + first_slot + i;
        float fraction = starts ? float(before) / float(count) : 1.0;
        light_irradiance[value] = light_irradiance[value] * fraction + total[i] / float(count);
    }
}
