// Outgoing flux of large clusters by direction: the sum of the children's flux. Deterministic. One
// invocation = one direction of one cluster. In: flux one level down (W). Out: flux (W).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct GlossLevelPush {
    uint first_bin;  // of the level
    uint bin_count;
    uint leaf_count;  // gloss bins that are not sums
};

layout(scalar, binding = 0) readonly buffer ChildOffsets { uint child_offsets[]; };
layout(scalar, binding = 1) readonly buffer Children { uint children[]; };
layout(scalar, binding = 2) buffer GlossFluxes { vec3 gloss_fluxes[]; };
layout(scalar, push_constant) uniform Push { GlossLevelPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.bin_count) return;
    uint gloss_bin = push.first_bin + index;
    vec3 sum = vec3(0.0);
    for (uint i = child_offsets[gloss_bin - push.leaf_count]; i < child_offsets[gloss_bin - push.leaf_count + 1u]; ++i) {
        sum += gloss_fluxes[children[i]];
    }
    gloss_fluxes[gloss_bin] = sum;
}
