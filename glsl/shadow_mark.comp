// Antialiasing of a light, step 2: marks the pixels across which its light changes much, an edge of a shadow, where
// geometry shows none: those pixels are averaged over samples already. And those of them that need more samples. Deterministic.
// One invocation = one pixel. In: the light's layer, edge pixels and their needs. Out: 1 for such a pixel, else 0.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 0) const uint CONTRAST = 0;  // float bits: relative difference between neighbours that makes an edge

struct EdgeMarkPush {
    uint width;
    uint height;
};

layout(scalar, binding = 0) readonly buffer LightLayer { float light_layer[]; };
layout(scalar, binding = 1) readonly buffer EdgeOffsets { uint edge_offsets[]; };
layout(scalar, binding = 2) writeonly buffer ShadowOffsets { uint shadow_offsets[]; };
layout(scalar, binding = 3) readonly buffer EdgeNeeds { uint edge_needs[]; };
layout(scalar, push_constant) uniform Push { EdgeMarkPush push; };

void main() {
    ivec2 size = ivec2(push.width, push.height);
    ivec2 xy = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(xy, size))) return;
    int index = xy.y * size.x + xy.x;
    float here = light_layer[index];
    bool found = false;
    for (int i = 1; i < 9; i += 2) {
        // Above, left, right, below.
        ivec2 other = clamp(xy + ivec2(i % 3, i / 3) - 1, ivec2(0), size - 1);
        float there = light_layer[other.y * size.x + other.x];
        found = found || abs(here - there) > uintBitsToFloat(CONTRAST) * max(here, there);
    }
    uint edge = edge_offsets[index];
    for (bool is_due = edge_offsets[index + 1] != edge; is_due; is_due = false) found = edge_needs[edge] != 0u;
    shadow_offsets[index] = uint(found);
}
