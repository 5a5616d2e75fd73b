// Adds what surfaces that shine send of one light by the first reflection: towards directions (W), or to samples of pixels (W/m²).
// Deterministic. One invocation = one direction of one cluster, or one sample. In: the light's part, per unit of its emission.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct GlossSumPush {
    vec3 emission;    // of the light
    uint count;
};

layout(scalar, binding = 0) readonly buffer LightPart { vec3 light_part[]; };
layout(scalar, binding = 1) buffer GlossTotal { vec3 gloss_total[]; };
layout(scalar, push_constant) uniform Push { GlossSumPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.count) return;
    gloss_total[index] += push.emission * light_part[index];
}
