// Bright clusters, step 2: whether some may be bright, and the sizes of the dispatches of the steps
// that follow; none has a workgroup if not. Deterministic. One invocation. In: sums of workgroups,
// sizes of dispatches. Out: state, sizes.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/bright.glsl"

layout(local_size_x = 1) in;

struct BrightTotalPush {
    uint sum_count;
    uint size_count;  // words of all sizes
    float contrast;   // least mean radiant exitance of light, over that of area
};

layout(scalar, binding = 0) readonly buffer BrightSums { BrightState bright_sums[]; };
layout(scalar, binding = 1) readonly buffer AllSizes { uint all_sizes[]; };
layout(scalar, binding = 2) writeonly buffer BrightStates { BrightState bright_state[]; };  // one
layout(scalar, binding = 3) writeonly buffer BrightSizes { uint bright_sizes[]; };
layout(scalar, push_constant) uniform Push { BrightTotalPush push; };

void main() {
    vec3 sum = vec3(0.0);
    for (uint index = 0u; index < push.sum_count; ++index) {
        BrightState part = bright_sums[index];
        sum += vec3(part.light, part.area, part.square);
    }
    bool is_on = sum.z * sum.y > push.contrast * sum.x * sum.x;
    bright_state[0] = BrightState(sum.x, sum.y, sum.z, uint(is_on));
    for (uint word = 0u; word < push.size_count; ++word) bright_sizes[word] = is_on ? all_sizes[word] : 0u;
}
