// Glossy pixels, step 1: marks the pixels whose material has a Phong lobe, and clears the glossy
// radiance of all pixels. Deterministic. One invocation = one pixel. In: surfaces at the pixels.
// Out: 1 for a glossy pixel, else 0; glossy radiance 0.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;

struct GlossMarkPush { uint pixel_count; };

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 1) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 2) uniform usamplerBuffer Pixels;
layout(scalar, binding = 3) writeonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 4) writeonly buffer GlossRadiance { PixelGloss gloss_radiance[]; };
layout(scalar, push_constant) uniform Push { GlossMarkPush push; };

#include "include/surfaces.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uint side = pixel_surface_at(Pixels, index).side;
    bool is_glossy = side != NO_SIDE && any(greaterThan(materials[surface_at(side >> 1).material].specular, vec3(0.0)));
    gloss_offsets[index] = uint(is_glossy);
    gloss_radiance[index] = PixelGloss(vec3(0.0), vec3(0.0));
}
