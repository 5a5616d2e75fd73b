// Tone map: radiance to sRGB codes. The exact sRGB curve up to SHOULDER, so that mid-grey and what diffuse surfaces show stay
// where sRGB puts them; above it a shoulder of continuous slope that reaches white only at infinity. Deterministic.
// One invocation = one pixel. In: radiance (W/m²/sr), exposure. Out: R | G << 8 | B << 16 | 255 << 24.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"

layout(local_size_x = 64) in;

struct TonemapPush {
    uint pixel_count;
    float scale;  // 2^exposure
};

layout(scalar, binding = 0) readonly buffer Radiance { vec3 radiance[]; };
layout(scalar, binding = 1) writeonly buffer Display { uint display[]; };
layout(scalar, push_constant) uniform Push { TonemapPush push; };

const float SHOULDER = 0.8;

uint display_value(float linear) {
    float beyond = (linear - SHOULDER) / (1.0 - SHOULDER);
    float toned = linear > SHOULDER ? 1.0 - (1.0 - SHOULDER) / (1.0 + beyond) : linear;
    float code = toned <= 0.0031308 ? 12.92 * toned : 1.055 * pow(toned, 1.0 / 2.4) - 0.055;
    // Negative values and NaN give 0.
    return code > 0.0 ? uint(min(255.0 * code + 0.5, 255.0)) : 0u;
}

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    vec3 value = push.scale * radiance[index];
    display[index] = display_value(value.r) | (display_value(value.g) << 8) | (display_value(value.b) << 16) | 0xff000000u;
}
