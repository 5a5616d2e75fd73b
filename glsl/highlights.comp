// Highlights: what the samples of shining pixels send to the camera of one light, straight from it, per unit of its emission and of the
// specular albedo; a shadow ray to each of its point samples that the lobe reaches. Deterministic. One invocation = one sample.
// In: samples, a light. Out: its layer, radiance.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;

struct HighlightsPush {
    vec3 eye;            // the camera, metres
    uint pixel_count;    // of the image
    uint most_samples;   // of a pixel
    uint capacity;       // samples that there is room for
    uint light;
    uint first_sample;   // of the light, in this dispatch; later ones add to what the first wrote
    uint end_sample;
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 4) readonly buffer Lights { LightSource lights[]; };
layout(scalar, binding = 5) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 6) readonly buffer GlossSamples { PixelSurface gloss_samples[]; };
layout(scalar, binding = 7) buffer HighlightLayer { float highlight_layer[]; };
layout(scalar, push_constant) uniform Push { HighlightsPush push; };

#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/direct.glsl"

// Share of a lobe's peak below which no ray is spent.
const float DARK = 1e-5;

void main() {
    uint index = flat_invocation();
    uint count = gloss_offsets[push.pixel_count];
    if (index >= count * gloss_samples_per_pixel(count, push.most_samples, push.capacity)) return;
    LightSource light = lights[push.light];
    PixelSurface point = gloss_samples[index];
    vec3 normal = surfaces[point.side >> 1].normal;
    if ((point.side & 1u) != 0u) normal = -normal;
    float exponent = materials[surfaces[point.side >> 1].material].exponent;
    vec3 mirror = reflect(normalize(point.position - push.eye), point.normal);
    float sum = 0.0;
    for (uint i = push.first_sample; i < push.end_sample; ++i) {
        LightSample found;
        if (!sample_light(light, point.position, lattice_point(light, i), found)) continue;
        float lobe = phong_lobe(mirror, found.direction, exponent);
        if (lobe < DARK) continue;
        sum += lobe * light_factor(light, i, i + 1u, false, point.position, normal, point.normal, point.footprint);
    }
    float before = push.first_sample == 0u ? 0.0 : highlight_layer[index];
    highlight_layer[index] = before + sum * (exponent + 2.0) / (2.0 * PI);
}
