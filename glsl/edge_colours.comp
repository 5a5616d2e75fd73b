// Colours of images at edge pixels: the mean over the samples of each fragment. The kernel traces
// no ray and runs only in scenes with images. Deterministic. One invocation = one fragment. In:
// surfaces at the samples, images. Out: packed colours.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/edge_places.glsl"
#include "include/colour.glsl"

layout(local_size_x = 64) in;

struct EdgeColoursPush {
    View view;
    EdgeCapacity capacity;
};

layout(binding = 0) uniform usamplerBuffer Triangles;
layout(binding = 1) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 2) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 3) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(binding = 4) uniform usamplerBuffer EdgeSamples;
layout(binding = 5) uniform usamplerBuffer SampleMasks;
layout(scalar, binding = 6) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(binding = 7) uniform usamplerBuffer Fragments;
layout(scalar, binding = 8) readonly buffer EdgeGroups { uint edge_groups[]; };
layout(scalar, binding = 9) writeonly buffer EdgeColours { uint edge_colours[]; };
layout(scalar, binding = 10) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 11) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 12) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { EdgeColoursPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/textures.glsl"
#include "include/pixel_colours.glsl"

void main() {
    View view = push.view;
    uint index = flat_invocation();
    if (index >= edge_groups[19]) return;
    uint count = samples_per_edge(edge_numbers[view.width * view.height], push.capacity);
    Fragment fragment = fragment_at(Fragments, index);
    uint own = index - fragment_firsts[fragment.edge];
    uint pixel = edge_pixels[fragment.edge];
    vec2 corner = vec2(in_rows(pixel, view.width));
    vec3 sum = vec3(0.0);
    Members members = members_of(SampleMasks, fragment.edge, count, own);
    for (uint k = 0u; k < samples_of(fragment); ++k) {
        uint i = next_of(SampleMasks, members);
        uint side = word_at(EdgeSamples, fragment.edge * count + i);
        sum += colour_through(view, corner + place_in_pixel(i, pixel), side >> 1).xyz;
    }
    edge_colours[index] = pack_colour(sum / float(samples_of(fragment)));
}
