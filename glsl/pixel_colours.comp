// Colours of images at pixels: the mean over the area of a pixel in which it shows the centre's
// surface. The kernel traces no ray and runs only in scenes with images. Deterministic. One
// invocation = one pixel. In: surfaces at the pixels, images. Out: packed colours.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/colour.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint POINTS = 0;  // along each side of a pixel

struct PixelColoursPush { View view; };

layout(binding = 0) uniform usamplerBuffer Triangles;
layout(binding = 1) uniform usamplerBuffer Surfaces;
layout(binding = 2) uniform usamplerBuffer Pixels;
layout(scalar, binding = 3) writeonly buffer PixelColours { uint pixel_colours[]; };
layout(scalar, binding = 4) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 5) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 6) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { PixelColoursPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/textures.glsl"
#include "include/pixel_colours.glsl"

void main() {
    uint index = flat_invocation();
    View view = push.view;
    if (index >= view.width * view.height) return;
    uint side = pixel_surface_at(Pixels, index).side;
    vec2 corner = vec2(in_rows(index, view.width));
    vec4 sum = vec4(0.0);
    // The mean excludes points beyond the horizon of the surface's plane.
    float sign_seen = (side & 1u) != 0u ? 1.0 : -1.0;
    for (uint i = 0u; i < POINTS * POINTS && side != NO_SIDE; ++i) {
        vec2 point = corner + (vec2(i % POINTS, i / POINTS) + 0.5) / float(POINTS);
        vec4 found = colour_through(view, point, side >> 1);
        if (found.w * sign_seen > 0.0) sum += vec4(found.xyz, 1.0);
    }
    // All points of the grid may lie in holes; the centre does not.
    if (HAS_CUTOUTS != 0u && sum.w == 0.0 && side != NO_SIDE) sum = colour_through(view, corner + 0.5, side >> 1);
    pixel_colours[index] = pack_colour(sum.xyz / max(sum.w, 1.0));
}
