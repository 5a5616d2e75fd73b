// Glossy pixels, step 1: marks the pixels that show a material with a Phong lobe, at their centre
// or, if they are edge pixels, in some fragment; and clears the glossy radiance of all pixels.
// Deterministic. One invocation = one pixel. In: surfaces at the pixels, fragments. Out: two lists
// of marks, 1 for a glossy pixel, else 0: of pixels with a lobe that takes rays, and of the other
// glossy ones; glossy radiance 0.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/antialias.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;

struct GlossMarkPush {
    EdgeCapacity edge_capacity;
    uint pixel_count;
    uint broad_exponents;  // see `is_broad`
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 1) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 2) uniform usamplerBuffer Pixels;
layout(scalar, binding = 3) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 4) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(binding = 5) uniform usamplerBuffer FragmentSurfaces;
layout(scalar, binding = 6) writeonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 7) writeonly buffer GlossRadiance { PixelGloss gloss_radiance[]; };
layout(scalar, push_constant) uniform Push { GlossMarkPush push; };

#include "include/surfaces.glsl"
#include "include/seen_fragments.glsl"

const uint GLOSSY = 1u;
const uint TRACED = 2u;  // with a lobe that takes rays

uint gloss_of(uint side) {
    if (side == NO_SIDE) return 0u;
    Reflectance material = materials[surface_at(side >> 1).material];
    if (!has_lobe(material)) return 0u;
    return is_broad(material, push.broad_exponents) ? GLOSSY : GLOSSY | TRACED;
}

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    SeenFragments shown = fragments_of(index, push.pixel_count, push.edge_capacity);
    uint gloss = shown.is_edge ? 0u : gloss_of(pixel_surface_at(Pixels, index).side);
    for (uint i = shown.first; i < shown.end; ++i) gloss |= gloss_of(pixel_surface_at(FragmentSurfaces, i).side);
    gloss_offsets[index] = uint((gloss & TRACED) != 0u);
    gloss_offsets[push.pixel_count + index] = uint(gloss == GLOSSY);
    gloss_radiance[index] = PixelGloss(vec3(0.0), vec3(0.0));
}
