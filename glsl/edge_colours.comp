// Colours of images at the samples of edge pixels. No ray is traced. Deterministic. One invocation = one sample.
// In: what the samples see, images. Out: packed colours. Only in scenes with images.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/sampling.glsl"
#include "include/antialias.glsl"
#include "include/colour.glsl"

layout(local_size_x = 64) in;

struct EdgeColoursPush {
    View view;
    uint most_samples;  // of a pixel
    uint capacity;      // samples that there is room for
};

layout(scalar, binding = 0) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 1) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 2) readonly buffer EdgeOffsets { uint edge_offsets[]; };
layout(scalar, binding = 3) readonly buffer EdgePixels { uint edge_pixels[]; };
layout(scalar, binding = 4) readonly buffer EdgeSurfaces { PixelSurface edge_surfaces[]; };
layout(scalar, binding = 5) readonly buffer EdgeSources { EdgeSource edge_sources[]; };
layout(scalar, binding = 6) writeonly buffer EdgeColours { uint edge_colours[]; };
layout(scalar, binding = 7) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 8) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 9) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { EdgeColoursPush push; };

#include "include/textures.glsl"
#include "include/pixel_colours.glsl"

void main() {
    View view = push.view;
    uint edge_count = edge_offsets[view.width * view.height];
    uint count = samples_per_edge(edge_count, push.most_samples, push.capacity);
    uint index = flat_invocation();
    if (index >= edge_count * count) return;
    uint pixel = edge_pixels[index / count];
    uint side = edge_surfaces[index].side;
    vec2 corner = vec2(pixel % view.width, pixel / view.width);
    vec3 colour = vec3(0.0);
    for (bool is_due = side != NO_SIDE; is_due; is_due = false) {
        // The very point that `edge_samples` asked.
        colour = colour_through(view, corner + sample_3d(edge_sources[index].number, pixel).xy, side >> 1).xyz;
    }
    edge_colours[index] = pack_colour(colour);
}
