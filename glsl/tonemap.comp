// Tone map: radiance to sRGB codes, in four steps: exposure, white balance, tone curve, and the
// sRGB curve. Rounding is dithered, so that dark gradients show no bands. Deterministic.
// One invocation = one pixel. In: radiance (W/m²/sr), or two whose weighted sum is shown; a display
// transform. Out: R | G << 8 | B << 16 | 255 << 24.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/dispatch.glsl"
#include "include/sampling.glsl"
#include "include/tone_curves.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint CURVE = 0;  // the tone curve
layout(constant_id = 1) const uint MIXES = 0;  // 1: the picture is gains · with + (1 - gains) · without

struct TonemapPush {
    uint pixel_count;
    float scale;  // 2^exposure
    uint is_balanced;  // 1: the three rows below are the white balance
    vec3 red;  // linear Rec.709 from linear Rec.709
    vec3 green;
    vec3 blue;
    vec3 gains;
};

layout(scalar, binding = 0) readonly buffer Radiance { vec3 radiance[]; };
layout(scalar, binding = 1) readonly buffer Without { vec3 without[]; };
layout(scalar, binding = 2) writeonly buffer Display { uint display[]; };
layout(scalar, push_constant) uniform Push { TonemapPush push; };

const float SHOULDER = 0.8;

// The standard curve: the identity up to SHOULDER, so that mid-grey and diffuse surfaces keep their
// sRGB values. Above it a shoulder of continuous slope that reaches white only at infinity.
float standard_curve(float linear) {
    float beyond = (linear - SHOULDER) / (1.0 - SHOULDER);
    return linear > SHOULDER ? 1.0 - (1.0 - SHOULDER) / (1.0 + beyond) : linear;
}

vec3 toned(vec3 linear) {
    if (CURVE == CURVE_NONE) return linear;
    if (CURVE == CURVE_FILMIC) return filmic_curve(bounded(linear));
    if (CURVE == CURVE_ACES) return aces_curve(bounded(linear));
    if (CURVE == CURVE_AGX) return agx_curve(bounded(linear));
    return vec3(standard_curve(linear.r), standard_curve(linear.g), standard_curve(linear.b));
}

// The sRGB code of a display value before it is rounded, 0..=255. Negative values and NaN give 0.
float display_code(float toned) {
    // White stays exact, whatever the error of the device's pow.
    if (toned >= 1.0) return 255.0;
    float code = toned <= 0.0031308 ? 12.92 * toned : 1.055 * pow(toned, 1.0 / 2.4) - 0.055;
    return code > 0.0 ? min(255.0 * code, 255.0) : 0.0;
}

// Uniform in [0, 1), of 16 bits: a sum with a code is exact.
float dither_noise(uint pixel, uint channel) { return float(hash(3u * pixel + channel) >> 16) / 65536.0; }

// Rounds a code up or down, so that its mean over pixels is the code. The noise is triangular: the
// difference between a pixel's uniform number and its right neighbour's, which is high-frequency
// noise. Near black and white it narrows to the uniform number alone, because clamping a triangle
// would shift the mean; black and white are exact.
uint dithered(float code, uint pixel, uint channel) {
    float width = clamp(2.0 * min(code, 255.0 - code), 0.0, 1.0);
    float noise = dither_noise(pixel, channel) + width * (0.5 - dither_noise(pixel + 1u, channel));
    return uint(clamp(floor(code + noise), 0.0, 255.0));
}

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    vec3 linear = radiance[index];
    if (MIXES != 0u) linear = push.gains * linear + (1.0 - push.gains) * without[index];
    vec3 value = push.scale * linear;
    if (push.is_balanced != 0u) {
        // Without bounds, an infinite channel would make others NaN.
        value = bounded(value);
        value = vec3(dot(push.red, value), dot(push.green, value), dot(push.blue, value));
    }
    value = toned(value);
    uint red = dithered(display_code(value.r), index, 0u);
    uint green = dithered(display_code(value.g), index, 1u);
    uint blue = dithered(display_code(value.b), index, 2u);
    display[index] = red | (green << 8) | (blue << 16) | 0xff000000u;
}
