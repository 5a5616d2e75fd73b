// Direct illumination: irradiance at every pixel from every light, one shadow ray each. [Yue §4, Tdi] Deterministic.
// One invocation = one pixel. In: what the pixels see, lights (W/sr). Out: irradiance, W/m².
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/math.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

struct DirectPush {
    uint width;
    uint height;
    uint light_count;
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer Lights { LightSource lights[]; };
layout(scalar, binding = 4) readonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, binding = 5) writeonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(scalar, push_constant) uniform Push { DirectPush push; };

#include "include/bvh.glsl"
#include "include/direct.glsl"

void main() {
    uvec2 xy = gl_GlobalInvocationID.xy;
    if (xy.x >= push.width || xy.y >= push.height) return;
    uint index = xy.y * push.width + xy.x;
    direct_irradiance[index] = direct_light(pixels[index], push.light_count);
}
