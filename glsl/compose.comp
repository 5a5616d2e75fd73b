// Radiance towards the camera: albedo times direct and indirect irradiance. Deterministic. One invocation = one pixel.
// In: irradiances (W/m²), reflectances. Out: radiance, W/m²/sr; black where a ray left the scene.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"

layout(local_size_x = 64) in;

struct ComposePush { uint pixel_count; };

layout(scalar, binding = 0) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 1) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 2) readonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, binding = 3) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(scalar, binding = 4) readonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(scalar, binding = 5) writeonly buffer Radiance { vec3 radiance[]; };
layout(scalar, push_constant) uniform Push { ComposePush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uint side = pixels[index].side;
    vec3 result = vec3(0.0);
    if (side != NO_SIDE) {
        vec3 albedo = materials[surfaces[side >> 1].material].diffuse;
        result = albedo * (direct_irradiance[index] + indirect_irradiance[index]) * (1.0 / PI);
    }
    radiance[index] = result;
}
