// Antialiasing of a light, step 2: lists the fragments that the light may illuminate in part: those
// in its penumbra, and those whose light differs from that of the same surface at the pixels
// around. All others keep the light at their point. The list is unordered, because each fragment is
// averaged by itself. Sizes a dispatch of eight fragments a workgroup. One invocation = one
// fragment. In: fragments, the per-light irradiance buffer at pixels and fragments. Out: fragments,
// their number and that of their samples, dispatch size; initially zero.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct FragmentMarkPush {
    uint width;
    uint height;
    uint light_samples;  // of a mixed fragment at most
    float contrast;      // relative difference of a light on one surface that makes an edge
};

layout(scalar, binding = 0) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 1) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 2) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(binding = 3) uniform usamplerBuffer Fragments;
layout(scalar, binding = 4) readonly buffer EdgeGroups { uint edge_groups[]; };
layout(scalar, binding = 5) readonly buffer LightIrradiance { float light_irradiance[]; };
layout(scalar, binding = 6) writeonly buffer MixedFragments { uint mixed_fragments[]; };
layout(scalar, binding = 7) buffer ShadowGroups { uint shadow_groups[]; };
layout(scalar, push_constant) uniform Push { FragmentMarkPush push; };

// Whether the light elsewhere on a surface says that a shadow may end between both points.
bool differs(float here, float there) {
    float most = max(abs(here), abs(there));
    bool has_mark = floatBitsToUint(there) >> 31 != 0u;
    return has_mark || (most > 0.0 && abs(abs(here) - abs(there)) >= push.contrast * most);
}

void main() {
    uint index = flat_invocation();
    if (index >= edge_groups[19]) return;
    uvec2 size = uvec2(push.width, push.height);
    uint pixel_count = size.x * size.y;
    Fragment own = fragment_at(Fragments, index);
    uint pixel = edge_pixels[own.edge];
    float here = light_irradiance[pixel_count + index];
    bool is_mixed = floatBitsToUint(here) >> 31 != 0u || push.contrast <= 0.0;
    for (uint place = 0u; place < 9u && !is_mixed; ++place) {
        if (is_alike(own, place)) is_mixed = differs(here, light_irradiance[pixel_at(size, pixel, place)]);
    }
    uint links = is_mixed ? 0u : own.neighbours;
    while (links != 0u) {
        uint link = uint(findLSB(links));
        links &= links - 1u;
        uint n = link / 4u;
        uint edge = edge_numbers[pixel_at(size, pixel, n + uint(n >= 4u))];
        is_mixed = is_mixed || differs(here, light_irradiance[pixel_count + fragment_firsts[edge] + link % 4u]);
    }
    if (!is_mixed) return;
    uint place = atomicAdd(shadow_groups[11], 1u);
    mixed_fragments[place] = index;
    atomicAdd(shadow_groups[12], min(samples_of(own), push.light_samples));
    // The first fragment of a group counts the group.
    if (place % 8u != 0u) return;
    for (uint axis = 0u; axis < 3u; ++axis) atomicMax(shadow_groups[8u + axis], swizzled(place / 8u + 1u)[axis]);
}
