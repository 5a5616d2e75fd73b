// Radiance towards the camera: albedo times direct and indirect irradiance, averaged over the samples where a pixel shows an
// edge. Deterministic. One invocation = one pixel. In: irradiances (W/m²), reflectances, edge samples.
// Out: radiance, W/m²/sr; black where a ray left the scene.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/antialias.glsl"
#include "include/colour.glsl"

layout(local_size_x = 64) in;

struct ComposePush {
    uint pixel_count;
    uint most_samples;     // of an edge pixel
    uint capacity;         // samples that there was room for
    float direct_share;    // 1, or 0 for a picture without direct light
    float indirect_share;  // the same for indirect light
};

layout(scalar, binding = 0) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 1) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 2) readonly buffer Pixels { PixelSurface pixels[]; };
layout(scalar, binding = 3) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(scalar, binding = 4) readonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(scalar, binding = 5) readonly buffer EdgeOffsets { uint edge_offsets[]; };
layout(scalar, binding = 6) readonly buffer EdgeSamples { EdgeSample edge_samples[]; };
layout(scalar, binding = 7) writeonly buffer Radiance { vec3 radiance[]; };
layout(scalar, binding = 8) readonly buffer PixelColours { uint pixel_colours[]; };  // packed; only in scenes with images
layout(scalar, binding = 9) readonly buffer EdgeColours { uint edge_colours[]; };
layout(scalar, push_constant) uniform Push { ComposePush push; };

vec3 reflected(uint side, vec3 direct, uint source) {
    if (side == NO_SIDE) return vec3(0.0);
    vec3 irradiance = push.direct_share * direct + push.indirect_share * indirect_irradiance[source];
    return materials[surfaces[side >> 1].material].diffuse * irradiance * (1.0 / PI);
}

void main() {
    uint index = flat_invocation();
    if (index >= push.pixel_count) return;
    uint edge = edge_offsets[index];
    uint count = samples_per_edge(edge_offsets[push.pixel_count], push.most_samples, push.capacity);
    if (edge_offsets[index + 1u] == edge) count = 0u;
    vec3 sum = vec3(0.0);
    for (uint i = edge * count; i < (edge + 1u) * count; ++i) {
        vec3 found = reflected(edge_samples[i].side, edge_samples[i].direct, edge_samples[i].source);
        if (HAS_TEXTURES != 0u) found *= unpack_colour(edge_colours[i]);
        sum += found;
    }
    vec3 centre = reflected(pixels[index].side, direct_irradiance[index], index);
    if (HAS_TEXTURES != 0u) centre *= unpack_colour(pixel_colours[index]);
    radiance[index] = count == 0u ? centre : sum / float(count);
}
