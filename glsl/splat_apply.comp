// Splatting, step 3: indirect irradiance at every pixel, each record extrapolated to it by its
// gradients. [Yue §4; Krivanek] A sparse matrix–vector product, and the only splat step that a
// light edit under a still camera needs. Deterministic. One invocation = one pixel. In: weights,
// records. Out: irradiance, W/m².
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/splat.glsl"

layout(local_size_x = 64) in;

struct SplatApplyPush {
    uint pixel_count;
    uint weight_capacity;
};

layout(binding = 0) uniform usamplerBuffer Pixels;
layout(binding = 1) uniform usamplerBuffer WeightRanges;  // of each pixel
layout(binding = 2) uniform usamplerBuffer Weights;
layout(binding = 3) uniform usamplerBuffer Records;  // `Record`s
layout(scalar, binding = 4) writeonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(scalar, push_constant) uniform Push { SplatApplyPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    PixelSurface pixel = pixel_surface_at(Pixels, index);
    vec3 irradiance = vec3(0.0);
    vec3 offset = vec3(0.0);
    mat3 translation = mat3(0.0);
    uvec2 range = pair_at(WeightRanges, index);
    for (uint i = range.x; i < min(range.y, push.weight_capacity); ++i) {
        uvec2 splat = pair_at(Weights, i);  // a `SplatWeight`
        Record record = record_at(Records, splat.x);
        float signed_weight = uintBitsToFloat(splat.y);
        float weight = abs(signed_weight);
        // Trapezoidal rule: half of the offset by the record's gradient here, half by the mean
        // gradient at the pixel below, so that the curvature terms cancel.
        vec3 moved = pixel.position - record.position;
        vec3 change = 0.5 * moved * record.translation + pixel.normal * record.rotation;
        // Gradients are unreliable beyond the validity of a record.
        if (signed_weight < 0.0) {
            change = clamp(change, -0.5 * record.irradiance, record.irradiance);
            record.translation = mat3(0.0);
        }
        // Irradiance is never negative; a linear extrapolation can be.
        irradiance += weight * max(record.irradiance + change, vec3(0.0));
        offset += weight * moved;
        translation += weight * record.translation;
    }
    irradiance = max(irradiance + 0.5 * offset * translation, vec3(0.0));
    indirect_irradiance[index] = irradiance;
}
