// Glossy pixels, step 3: samples what each pixel shows of glossy surfaces, because a curved mirror
// turns within a pixel. An edge pixel takes its samples of its glossy fragments: where a thin
// mirror stands before a wall, none falls on the wall. Any other pixel takes points spread over its
// area. Deterministic. One invocation = every `stride`th sample. In: glossy pixels, fragments. Out:
// surfaces at the samples, pixel by pixel, and the parts of pixels for which they stand.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/antialias.glsl"
#include "include/edge_places.glsl"
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;

struct GlossSampling {
    uint max_samples;  // of a pixel
    uint capacity;     // of the list of samples
    uint stride;       // invocations
    uint seed;
};

struct GlossSamplesPush {
    View view;
    EdgeCapacity edge_capacity;
    GlossSampling sampling;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 4) uniform usamplerBuffer Pixels;
layout(scalar, binding = 5) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(binding = 6) uniform usamplerBuffer EdgeSamples;
layout(binding = 7) uniform usamplerBuffer SampleMasks;
layout(scalar, binding = 8) readonly buffer FragmentFirsts { uint fragment_firsts[]; };
layout(binding = 9) uniform usamplerBuffer Fragments;
layout(binding = 10) uniform usamplerBuffer FragmentSurfaces;
layout(scalar, binding = 11) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 12) readonly buffer GlossPixels { uint gloss_pixels[]; };
layout(scalar, binding = 13) writeonly buffer GlossSamples { PixelSurface gloss_samples[]; };
layout(scalar, binding = 14) writeonly buffer GlossParts { GlossPart gloss_parts[]; };  // of the samples
layout(scalar, binding = 15) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { GlossSamplesPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/seen_fragments.glsl"

uint material_of(uint side) { return surface_at(side >> 1).material; }

// Samples of the edge pixel on a fragment, if it is glossy.
uint glossy_samples_of(uint fragment) {
    uint side = pixel_surface_at(FragmentSurfaces, fragment).side;
    return has_lobe(materials[material_of(side)]) ? samples_of(fragment_at(Fragments, fragment)) : 0u;
}

// A sample, its point in the image, and its weight in the mean over the pixel.
struct Sample {
    PixelSurface surface;
    vec2 point;
    float weight;
};

// The place of a sample on the fragments of an edge pixel.
struct Place {
    uint fragment;  // number in its pixel
    uint member;    // which of the pixel's samples on it
    float weight;
};

// Number of the fragment that holds the glossy sample of that rank.
uint owner_of(uvec4 sizes, uint rank) {
    uint owner = 0u;
    while (owner + 1u < MAX_FRAGMENTS && rank >= sizes[owner]) rank -= sizes[owner++];
    return owner;
}

// Place of sample `number` of `samples`, given the number of the pixel's samples on each fragment
// that is glossy. If they suffice, each such fragment takes one, and counts by its area. The rest
// are in proportion to their area. A fragment takes its first members, because a Sobol sequence
// spreads these.
Place place_on(uvec4 sizes, uint number, uint samples) {
    uint all = sizes.x + sizes.y + sizes.z + sizes.w;
    uint firsts = 0u;  // fragments that take one
    for (uint k = 0u; k < MAX_FRAGMENTS; ++k) firsts += uint(sizes[k] > 0u);
    if (firsts > samples) firsts = 0u;
    uint rest = samples - firsts;
    uint fragment = 0u;
    uint order = 0u;
    for (uint k = 0u; k < MAX_FRAGMENTS; ++k) {
        if (sizes[k] > 0u && order++ == number) fragment = k;
    }
    if (number >= firsts) fragment = owner_of(sizes, (2u * (number - firsts) + 1u) * all / (2u * rest));
    uint of_fragment = uint(firsts > 0u);
    uint before = uint(firsts > 0u && number >= firsts);
    for (uint i = 0u; i < rest; ++i) {
        bool is_own = owner_of(sizes, (2u * i + 1u) * all / (2u * rest)) == fragment;
        of_fragment += uint(is_own);
        before += uint(is_own && firsts + i < number);
    }
    float weight = firsts > 0u ? float(sizes[fragment]) / float(all * of_fragment) : 1.0 / float(samples);
    return Place(fragment, before % max(sizes[fragment], 1u), weight);
}

// Sample `number` of `samples` of an edge pixel. One on another material than its fragment takes
// the fragment's surface, by whose lobe the pixel was marked.
Sample on_fragment(SeenFragments shown, uint pixel, uint number, uint samples) {
    uvec4 sizes = uvec4(0u);
    for (uint i = shown.first; i < shown.end; ++i) sizes[i - shown.first] = glossy_samples_of(i);
    Place place = place_on(sizes, number, samples);
    uint edge = edge_numbers[pixel];
    uint count = samples_per_edge(edge_numbers[push.view.width * push.view.height], push.edge_capacity);
    Members members = members_of(SampleMasks, edge, count, place.fragment);
    uint found = 0u;
    for (uint i = 0u; i <= place.member; ++i) found = next_of(SampleMasks, members);
    vec2 point = vec2(in_rows(pixel, push.view.width)) + place_in_pixel(found, pixel);
    // More kinds of surface than a pixel has fragments join one of another material.
    PixelSurface own = pixel_surface_at(FragmentSurfaces, shown.first + place.fragment);
    uint side = word_at(EdgeSamples, edge * count + found);
    bool is_other = material_of(side) != material_of(own.side);
    if (is_other) return Sample(own, point, place.weight);
    return Sample(seen_on(push.view, point, side), point, place.weight);
}

// The same for a pixel without an edge. A sample that meets another material takes the centre's
// surface.
Sample in_pixel(uint pixel, uint number, uint samples) {
    vec2 corner = vec2(in_rows(pixel, push.view.width));
    vec2 point = corner + sample_3d(number, hash(hash(push.sampling.seed, pixel), 1u)).xy;
    PixelSurface centre = pixel_surface_at(Pixels, pixel);
    PixelSurface found = seen_through(push.view, point);
    bool is_other = found.side == NO_SIDE;
    if (!is_other) is_other = material_of(found.side) != material_of(centre.side);
    float weight = 1.0 / float(samples);
    if (is_other) return Sample(centre, corner + 0.5, weight);
    return Sample(found, point, weight);
}

// Mirror direction of the ray through an image point, on the plane of a triangle. Beyond the
// triangle its normals are extrapolated.
vec3 mirror_through(vec2 point, uint side) {
    return reflect(normalize(direction_through(push.view, point)), seen_on(push.view, point, side).normal);
}

// Change of the mirror direction from a sample to a point beside it.
vec3 turn_by(Sample sampled, vec2 offset) {
    uint side = sampled.surface.side;
    vec3 turn = mirror_through(sampled.point + offset, side) - mirror_through(sampled.point, side);
    // NaN where the camera looks along the plane.
    return dot(turn, turn) <= 4.0 ? turn : vec3(0.0);
}

void main() {
    uint pixel_count = push.view.width * push.view.height;
    GlossCounts counts = gloss_counts(gloss_offsets[pixel_count], gloss_offsets[2u * pixel_count], push.sampling.max_samples, push.sampling.capacity);
    for (uint index = flat_invocation(); index < sample_count(counts); index += push.sampling.stride) {
        uvec3 owner = owner_of_sample(counts, index);
        uint samples = owner.z;
        uint pixel = gloss_pixels[owner.y];
        SeenFragments shown = fragments_of(pixel, pixel_count, push.edge_capacity);
        Sample found = Sample(NOTHING_SEEN, vec2(0.0), 0.0);
        if_any (shown.is_edge) found = on_fragment(shown, pixel, owner.x, samples);
        if_any (!shown.is_edge) found = in_pixel(pixel, owner.x, samples);
        gloss_samples[index] = found.surface;
        float half_width = 0.5 * inversesqrt(float(samples));
        gloss_parts[index] = GlossPart(turn_by(found, vec2(half_width, 0.0)), turn_by(found, vec2(0.0, half_width)), found.weight);
    }
    if (!loops_completed(push.sampling.stride)) truncated_loops[0] = LOOP_TRUNCATED;
}
