// Beams of the sky without its bright spots at entry points that may be glossy: each stands for
// neighbouring rays that leave the scene. [Yue §1] Deterministic; traces no ray. One invocation =
// one beam at one entry point. In: entry points, their visible rays, the table of a sky. Out: beams
// per unit emission.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/octahedral.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint RINGS = 0;
layout(constant_id = 1) const uint SECTORS = 0;

struct SkyBeamsPush {
    uint entry_count;
    uint beam_count;   // of an entry point
    uint first_beam;   // of the sky, among these
    uint first_point;  // of the bound buffer of the visible rays
    uint point_count;  // in it
    uint first_radiance;  // first word of the sky's table in the table of lights
    uint side;            // of the table
    uint channels;        // sets of visible rays of an entry point
    uint channel;         // of these, the one for the light
    uint seed;
};

layout(binding = 0) uniform usamplerBuffer Lights;
layout(scalar, binding = 1) readonly buffer GlossEntries { GlossEntry gloss_entries[]; };
layout(scalar, binding = 2) readonly buffer PathStreams { uint path_streams[]; };  // random stream index of each entry point
layout(scalar, binding = 3) readonly buffer VisibleSky { uint visible_sky[]; };
layout(scalar, binding = 4) writeonly buffer GlossBeams { GlossBeam gloss_beams[]; };  // entry point by entry point
layout(scalar, push_constant) uniform Push { SkyBeamsPush push; };

#include "include/gather.glsl"
#include "include/sky_rays.glsl"

const uint SKY_BEAMS = SKY_RAYS / 4u;  // two rings by two sectors each

void main() {
    uint entry_index = flat_invocation() / SKY_BEAMS;
    uint beam_index = flat_invocation() % SKY_BEAMS;
    if (entry_index >= push.entry_count) return;
    GlossEntry entry = gloss_entries[entry_index];
    if (entry.path < push.first_point || entry.path >= push.first_point + push.point_count) return;
    uint pairs = SECTORS / 2u;
    uint first = beam_index / pairs * 2u * SECTORS + beam_index % pairs * 2u;
    GlossBeam beam = GlossBeam(entry.normal, 0.0);
    vec3 toward = vec3(0.0);
    uint point = entry.path - push.first_point;
    for (uint i = 0u; i < 4u; ++i) {
        uint ray = first + (i >> 1) * SECTORS + (i & 1u);
        uint set = point * push.channels + push.channel;
        uint visible = visible_sky[SKY_WORDS * set + ray / 32u];
        if ((visible >> (ray % 32u) & 1u) == 0u) continue;
        vec3 direction = sky_ray(entry.normal, ray, path_streams[point], push.seed);
        float factor = PI / float(SKY_RAYS) * number_at(Lights, push.first_radiance + octahedral_cell(direction, push.side));
        toward += factor * direction;
        beam.factor += factor;
    }
    if (toward != vec3(0.0)) beam.mirror = reflect(-normalize(toward), entry.normal);
    gloss_beams[entry_index * push.beam_count + push.first_beam + beam_index] = beam;
}
