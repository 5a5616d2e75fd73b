// Highlights: light of one light that the lobes of glossy pixels' samples reflect to the camera,
// per unit of emission and of specular albedo. A shadow ray goes to each point sample inside the
// lobe. If too few of an area light's samples lie in the lobe, and for the sky, directions sampled
// from the lobe replace the shadow rays. Deterministic. One invocation = one sample. In: samples, a
// light. Out: the highlights of the light (radiance).
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
#include "include/gloss_rays.glsl"

layout(local_size_x = 64) in;

struct HighlightsPush {
    vec3 eye;            // the camera, metres
    uint pixel_count;    // of the image
    uint max_samples;   // of a pixel
    uint capacity;       // of the list of samples
    uint light;
    uint first_sample;   // first point sample of this dispatch; later dispatches add to the first
    uint end_sample;
    uint seed;           // of the directions
    uint flags;          // TRACES_ALL, ADDS, IS_SKY
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 4) uniform usamplerBuffer Lights;
layout(scalar, binding = 5) readonly buffer GlossOffsets { uint gloss_offsets[]; };
layout(scalar, binding = 6) readonly buffer GlossSamples { PixelSurface gloss_samples[]; };
layout(scalar, binding = 7) readonly buffer GlossPixels { uint gloss_pixels[]; };
layout(scalar, binding = 8) buffer LightHighlights { float highlight_irradiance[]; };
layout(scalar, binding = 9) readonly buffer GlossParts { GlossPart gloss_parts[]; };  // of the samples
layout(scalar, binding = 10) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, binding = 11) readonly buffer Backgrounds { Background background[]; };  // one
layout(scalar, binding = 12) readonly buffer SkyTexels { vec3 sky_texels[]; };
layout(scalar, push_constant) uniform Push { HighlightsPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/direct.glsl"
#include "include/sky.glsl"

// Fraction of its peak below which a lobe counts as zero and takes no ray.
const float DARK = 1e-5;

// Solid angle of an area light as seen from a point, with all its area at its middle;
// zero from behind.
float seen_size(LightSource light, vec3 position) {
    vec3 to_light = light.position + 0.5 * (light.edge_u + light.edge_v) - position;
    float distance2 = dot(to_light, to_light);
    return light.area * emitted_cosine(light, -to_light) * inversesqrt(distance2) / distance2;
}

// Distance along a unit direction to an area light's emitting side, or zero. `axis` is a unit
// normal of its plane.
float distance_to(LightSource light, vec3 position, vec3 direction) {
    float facing = -dot(light.axis, direction);
    float t = dot(position - light.position, light.axis) / facing;
    vec3 inside = position + t * direction - light.position;
    bool is_triangle = (light.shape & SHAPE_TRIANGLE) != 0u;
    vec2 place = vec2(dot(cross(inside, light.edge_v), light.axis), dot(cross(light.edge_u, inside), light.axis)) / light.area;
    if (is_triangle) place *= 0.5;
    bool is_met = emitted_cosine(light, -direction) > 0.0 && t > 0.0 && all(greaterThanEqual(place, vec2(0.0))) && all(lessThanEqual(place, vec2(1.0)));
    if (is_triangle) is_met = is_met && place.x + place.y <= 1.0;
    return is_met ? t : 0.0;
}

// Mirror direction at a place around a sample, in units of the distance to the borders of its part.
vec3 turned(vec3 mirror, GlossPart part, vec2 place) { return normalize(mirror + place.x * part.across + place.y * part.down); }

// A lobe with that variance of its mirror direction more, as a fraction of the peak of the lobe
// itself, whose variance is 2/n: [Kaplanyan 2016]
float wider_lobe(vec3 mirror, float spread, vec3 direction, float exponent) {
    float wider = exponent / (1.0 + 0.5 * exponent * spread);
    return phong_lobe(mirror, direction, wider) * (wider + 2.0) / (exponent + 2.0);
}

// Spread, in variances of the lobe, up to which one lobe stands for all around a sample.
const float NARROW = 0.1;
const uint PLACES = 4u;  // along an axis, where one does not

// Mean of the lobe over the part of the pixel for which a sample stands, as a fraction of the
// lobe's peak. On curved surface mirror directions turn there by more than the lobe is wide. Then a
// highlight would show where a sample happens to meet it.
float mean_lobe(vec3 mirror, GlossPart part, vec3 direction, float exponent) {
    // Over a square, the mean of x² is a third of its largest value.
    float spread = (dot(part.across, part.across) + dot(part.down, part.down)) * (1.0 / 3.0);
    float sum = wider_lobe(mirror, spread, direction, exponent);
    if_any (0.5 * exponent * spread > NARROW) {
        sum = 0.0;
        for (uint i = 0u; i < PLACES * PLACES; ++i) {
            vec2 place = (2.0 * vec2(i % PLACES, i / PLACES) + 1.0) / float(PLACES) - 1.0;
            sum += wider_lobe(turned(mirror, part, place), spread / float(PLACES * PLACES), direction, exponent);
        }
        sum /= float(PLACES * PLACES);
    }
    return sum;
}

void main() {
    uint index = flat_invocation();
    GlossCounts counts = gloss_counts(gloss_offsets[push.pixel_count], gloss_offsets[2u * push.pixel_count], push.max_samples, push.capacity);
    if (index >= sample_count(counts)) return;
    LightSource light = light_at(Lights, push.light);
    PixelSurface point = gloss_samples[index];
    Receiver at = receiver_of(point);
    float exponent = materials[surface_at(point.side >> 1).material].exponent;
    GlossPart part = gloss_parts[index];
    vec3 mirror = reflect(normalize(point.position - push.eye), point.normal);
    // The lobe's own solid angle is 2π/(n+1): it holds fewer point samples than the directions that
    // would replace them, or not even one.
    float lobe_samples = max(1.0, float(light.samples) / float(LOBE_RAYS));
    bool is_large = light.kind == LIGHT_AREA && seen_size(light, at.position) * (exponent + 1.0) > 2.0 * PI * lobe_samples;
    bool is_sky = HAS_EMISSION != 0u && (push.flags & IS_SKY) != 0u;
    is_large = is_large || is_sky;
    float sum = 0.0;
    uint end = is_large ? push.first_sample : push.end_sample;
    for (uint i = push.first_sample; i < end; ++i) {
        LightSample found;
        if (!sample_light(light, at.position, lattice_point(light, i), found)) continue;
        float lobe = mean_lobe(mirror, part, found.direction, exponent);
        if (lobe < DARK) lobe = 0.0;
        if (lobe == 0.0 && (push.flags & TRACES_ALL) == 0u) continue;
        sum += lobe * (exponent + 2.0) / (2.0 * PI)
             * light_factor(light, i, i + 1u, push.flags, at.position, at.normal, point.normal, point.footprint);
    }
    sum = weighed(light, light.samples, sum, at.position, point.normal, point.footprint);
    uvec3 owner = owner_of_sample(counts, index);
    uint pixel_seed = hash(push.seed, gloss_pixels[owner.y]);
    uint first = LOBE_RAYS * owner.x;
    // The lobe's directions are traced in the first dispatch only, whatever the number
    // of point samples.
    uint last = is_large && push.first_sample == 0u ? first + LOBE_RAYS : first;
    for (uint i = first; i < last; ++i) {
        vec2 place = 2.0 * sample_3d(i, hash(pixel_seed, 1u)).xy - 1.0;
        vec3 direction = sample_phong_lobe(turned(mirror, part, place), exponent, sample_3d(i, pixel_seed).xy);
        float cosine = dot(point.normal, direction);
        float distance = is_sky ? LIGHT_FAR : distance_to(light, at.position, direction);
        if (distance == 0.0 || cosine <= 0.0 || dot(at.normal, direction) <= 0.0) continue;
        LightSample towards = LightSample(direction, distance, vec3(0.0));
        if (!is_lit(at.position, at.normal, towards)) continue;
        float radiance = is_sky ? sky_along(direction)[int(light.area)] : 1.0;
        radiance *= passed_by_panes(shadow_ray(at.position, at.normal, towards), light.shape >> CHANNEL_SHIFT);
        sum += radiance * cosine * (exponent + 2.0) / (exponent + 1.0) / float(LOBE_RAYS);
    }
    float before = is_first(push.flags, push.first_sample) ? 0.0 : highlight_irradiance[index];
    highlight_irradiance[index] = before + (is_sky ? 1.0 : light.relative) * sum;
    if (!loops_completed(push.pixel_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
