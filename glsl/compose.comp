// Radiance towards the camera: albedo times direct and indirect irradiance. An edge pixel sums this
// over its fragments. A second dispatch handles the few edge pixels, so that no pixel waits for a
// neighbour with fragments. Deterministic. One invocation = one pixel, or one edge pixel in
// the second dispatch. In: irradiances (W/m²; direct irradiance of the pixels, then of the
// fragments), reflectances, fragments. Out: radiance, W/m²/sr; black where a ray left a scene
// without a sky.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/antialias.glsl"
#include "include/gloss_rays.glsl"
#include "include/colour.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint IS_GLOSSY = 0;  // 1: some surfaces may be glossy
layout(constant_id = 1) const uint AT_EDGES = 0;  // 1: the dispatch over edge pixels, which overwrites their radiance

struct ComposePush {
    View view;
    EdgeCapacity capacity;
    vec3 emission_scale;             // factor of all light: the colour of the only active light
    float direct_weight;    // 1, or 0 for an image without direct light
    float indirect_weight;  // the same for indirect light
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(binding = 1) uniform usamplerBuffer Materials;
layout(binding = 2) uniform usamplerBuffer Pixels;
layout(scalar, binding = 3) readonly buffer DirectIrradiance { vec3 direct_irradiance[]; };
layout(scalar, binding = 4) readonly buffer IndirectIrradiance { vec3 indirect_irradiance[]; };
layout(scalar, binding = 5) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(scalar, binding = 6) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(scalar, binding = 7) readonly buffer GlossRadiance { PixelGloss gloss_radiance[]; };
layout(scalar, binding = 8) writeonly buffer Radiance { vec3 radiance[]; };
layout(scalar, binding = 9) readonly buffer PixelColours { uint pixel_colours[]; };  // packed; only in scenes with images
layout(scalar, binding = 10) readonly buffer EdgeColours { uint edge_colours[]; };
layout(scalar, binding = 11) readonly buffer EdgePixels { uint edge_pixels[]; };  // their indices
layout(scalar, binding = 12) readonly buffer Emitted { vec4 emitted[]; };
layout(scalar, binding = 13) readonly buffer Backgrounds { Background background[]; };  // one
layout(scalar, binding = 14) readonly buffer SkyTexels { vec3 sky_texels[]; };
layout(binding = 15) uniform usamplerBuffer Nodes;
layout(binding = 16) uniform usamplerBuffer Triangles;
layout(scalar, binding = 17) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, binding = 18) readonly buffer EdgeIrradiance { vec3 edge_irradiance[]; };  // indirect, at the edge points
layout(binding = 19) uniform usamplerBuffer Fragments;
layout(binding = 20) uniform usamplerBuffer FragmentSurfaces;
layout(scalar, push_constant) uniform Push { ComposePush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/emitted.glsl"
#include "include/sky.glsl"

// Fraction of light of each colour that panes let pass from a side, or from the sky, to a pixel.
vec3 passed_to(uint index, uint side) {
    if (HAS_PANES == 0u) return vec3(1.0);
    const vec2 POINTS[4] = vec2[](vec2(0.375, 0.125), vec2(0.875, 0.375), vec2(0.125, 0.625), vec2(0.625, 0.875));
    vec2 corner = vec2(in_rows(index, push.view.width));
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < 4u; ++i) {
        vec3 direction = direction_through(push.view, corner + POINTS[i]);
        float t = side == NO_SIDE ? 1e30 : hit_on_plane(push.view, direction, side >> 1).t;
        // A plane beside the image point may be met behind the camera.
        sum += passed_by_panes(Ray(push.view.position, direction, t > 0.0 ? 0.9999 * t : 1e30));
    }
    return 0.25 * sum;
}

uint material_of(uint side) { return surface_at(side >> 1).material; }

// Light that a surface which `pixel` shows reflects; `colour` is the colour of the material's
// image. The pixel's gloss is a mean over all glossy surface in it.
vec3 reflected(uint side, vec3 colour, vec3 direct, vec3 indirect, uint pixel) {
    if (side == NO_SIDE) return vec3(0.0);
    vec3 irradiance = push.direct_weight * direct + push.indirect_weight * indirect;
    Reflectance material = reflectance_at(Materials, material_of(side));
    vec3 radiance = material.diffuse * irradiance * (1.0 / PI);
    if (HAS_TEXTURES != 0u) radiance *= colour;
    if (IS_GLOSSY == 1u && any(greaterThan(material.specular, vec3(0.0)))) {
        PixelGloss gloss = gloss_radiance[pixel];
        radiance += push.direct_weight * gloss.direct + push.indirect_weight * gloss.indirect;
    }
    return radiance;
}

// Radiance that the surface at a point, or the sky behind the image point, sends to the camera.
vec3 emitted_at(uint side, vec2 point) {
    if (HAS_EMISSION == 0u) return vec3(0.0);
    vec3 found = side == NO_SIDE ? background_along(direction_through(push.view, point)) : emitted_by(material_of(side), (side & 1u) != 0u);
    return push.direct_weight * found;
}

// Middle of a pixel in the image.
vec2 middle_of(uint index) { return vec2(in_rows(index, push.view.width)) + 0.5; }

// Radiance of the surface at the centre of a pixel.
vec3 centre(uint index) {
    vec3 colour = HAS_TEXTURES != 0u ? unpack_colour(pixel_colours[index]) : vec3(1.0);
    uint side = pixel_surface_at(Pixels, index).side;
    vec3 found = push.emission_scale * reflected(side, colour, direct_irradiance[index], indirect_irradiance[index], index) + emitted_at(side, middle_of(index));
    return passed_to(index, side) * found;
}

// Mean radiance over the `count` samples of an edge pixel; `edge` is its index in the list of edge
// pixels.
vec3 mean_of_samples(uint edge, uint count, uint index) {
    uint pixel_count = push.view.width * push.view.height;
    uvec2 size = uvec2(push.view.width, push.view.height);
    vec3 sum = vec3(0.0);
    vec3 emission = vec3(0.0);
    float uncovered = 1.0;
    for (uint i = fragment_firsts[edge]; i < fragment_firsts[edge + 1u]; ++i) {
        Fragment fragment = fragment_at(Fragments, i);
        uint side = pixel_surface_at(FragmentSurfaces, i).side;
        float weight = float(samples_of(fragment)) / float(count);
        uint source = pixel_at(size, index, place_of(fragment));
        vec3 colour = HAS_TEXTURES != 0u ? unpack_colour(edge_colours[i]) : vec3(1.0);
        vec3 passed = weight * passed_to(index, side);
        vec3 indirect = indirect_irradiance[source];
        if_any (fragment.point != NO_POINT) indirect = edge_irradiance[fragment.point];
        sum += passed * reflected(side, colour, direct_irradiance[pixel_count + i], indirect, index);
        if (HAS_EMISSION != 0u) {
            emission += passed * emitted_at(side, vec2(0.0));
            uncovered -= weight;
        }
    }
    if (HAS_EMISSION != 0u && uncovered > 1e-4) emission += uncovered * passed_to(index, NO_SIDE) * emitted_at(NO_SIDE, middle_of(index));
    return push.emission_scale * sum + emission;
}

void main() {
    uint index = flat_invocation();
    uint pixel_count = push.view.width * push.view.height;
    if (AT_EDGES == 0u) {
        if (index < pixel_count) radiance[index] = centre(index);
        if (!loops_completed(pixel_count)) truncated_loops[0] = LOOP_TRUNCATED;
        return;
    }
    uint edge_count = edge_numbers[pixel_count];
    uint count = samples_per_edge(edge_count, push.capacity);
    if (index >= edge_count || count == 0u) return;
    uint pixel = edge_pixels[index];
    radiance[pixel] = mean_of_samples(index, count, pixel);
    if (!loops_completed(pixel_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
