// Colours of images at edge pixels: the mean over the samples of each slot. The kernel traces no
// ray and runs only in scenes with images. Deterministic. One invocation = one slot. In: surfaces
// at the samples, images. Out: packed colours.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
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
layout(scalar, binding = 4) readonly buffer EdgeSamples { EdgeSample edge_samples[]; };
layout(scalar, binding = 5) writeonly buffer EdgeColours { uint edge_colours[]; };
layout(scalar, binding = 6) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 7) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 8) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { EdgeColoursPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/textures.glsl"
#include "include/pixel_colours.glsl"

void main() {
    View view = push.view;
    uint edge_count = edge_numbers[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.capacity);
    uint slots = slots_per_edge(edge_count, push.capacity);
    uint index = flat_invocation();
    if (index >= edge_count * slots || count == 0u) return;
    uvec2 number = in_rows(index, slots);  // of the slot in its pixel, of the pixel
    uint edge = number.y;
    uint pixel = edge_pixels[edge];
    vec2 corner = vec2(in_rows(pixel, view.width));
    vec3 sum = vec3(0.0);
    float weight = 0.0;
    for (uint i = 0u; i < count; ++i) {
        EdgeSample found = edge_samples[edge * count + i];
        if (found.side == NO_SIDE || slot_of(found) != number.x) continue;
        // The image point that `edge_samples` traced.
        vec2 point = corner + sample_3d(i + point_of(found) * count, pixel).xy;
        sum += float(eighths_of(found)) * colour_through(view, point, found.side >> 1).xyz;
        weight += float(eighths_of(found));
    }
    edge_colours[index] = pack_colour(sum / max(weight, 1.0));
}
