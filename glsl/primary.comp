// Primary visibility: one ray through each pixel's centre. Deterministic. One invocation = one pixel.
// In: camera. Out: what the pixel sees.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/math.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

struct PrimaryPush { View view; };

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) writeonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, push_constant) uniform Push { PrimaryPush push; };

#include "include/bvh.glsl"

void main() {
    View view = push.view;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= view.width || pixel.y >= view.height) return;
    uint index = pixel.y * view.width + pixel.x;
    vec2 ndc = (vec2(pixel) + 0.5) / vec2(view.width, view.height) * 2.0 - 1.0;
    vec3 direction = view.forward + ndc.x * view.right - ndc.y * view.up;
    Hit hit;
    if (!trace(Ray(view.position, direction, 1e30), false, hit)) {
        pixels[index] = PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);
        return;
    }
    Surface surface = surfaces[hit.triangle];
    bool back = dot(surface.normal, direction) > 0.0;
    vec3 normal = normalize(hit.barycentric.x * surface.n0 + hit.barycentric.y * surface.n1 + hit.barycentric.z * surface.n2);
    // t is the depth along the view axis, because `direction` has unit length along it.
    float footprint = view.pixel_area * hit.t * hit.t;
    pixels[index] = PixelSurface(hit_position(hit), 2u * hit.triangle + uint(back), back ? -normal : normal, footprint);
}
