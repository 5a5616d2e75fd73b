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

void main() {
    uvec2 xy = gl_GlobalInvocationID.xy;
    if (xy.x >= push.width || xy.y >= push.height) return;
    uint index = xy.y * push.width + xy.x;
    PixelSurface pixel = pixels[index];
    vec3 irradiance = vec3(0.0);
    if (pixel.side != NO_SIDE) {
        vec3 normal = surfaces[pixel.side >> 1].normal;
        if ((pixel.side & 1u) != 0u) normal = -normal;
        for (uint i = 0u; i < push.light_count; ++i) {
            vec3 to_light = lights[i].position - pixel.position;
            float cosine = dot(pixel.normal, to_light);
            // A light behind the real surface does not shine through, wherever the shading normal points.
            if (cosine <= 0.0 || dot(normal, to_light) <= 0.0) continue;
            if (!is_visible(pixel.position, normal, lights[i].position)) continue;
            // Bounded by the pixel's own extent: a disc of that area cannot see more than half the light's sphere. [Wallace]
            float distance2 = dot(to_light, to_light);
            irradiance += lights[i].emission * (cosine * inversesqrt(distance2) / (distance2 + pixel.footprint / PI));
        }
    }
    direct_irradiance[index] = irradiance;
}
