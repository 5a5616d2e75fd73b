// Glossy pixels, step 2: lists the glossy pixels: those with rays, then the others, both in order.
// Deterministic. One invocation = one mark, of which a pixel has two. In: exclusive prefix sum of
// the marks, and the total. Out: indices of the glossy pixels.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct GlossListPush { uint pixel_count; };

layout(scalar, binding = 0) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 1) writeonly buffer GlossPixels { uint gloss_pixels[]; };
layout(scalar, push_constant) uniform Push { GlossListPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= 2u * push.pixel_count) return;
    uint place = gloss_offsets[index];
    if (gloss_offsets[index + 1u] != place) gloss_pixels[place] = index < push.pixel_count ? index : index - push.pixel_count;
}
