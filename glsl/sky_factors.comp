// Form factors of the sky without its bright spots: the radiance of the sky along the rays of each
// entry point that leave the scene. [Yue §3] Deterministic; traces no ray. One invocation = one
// entry point. In: entry points, their visible rays, the table of a sky. Out: its form factors, per
// unit emission, sr.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/octahedral.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint RINGS = 0;
layout(constant_id = 1) const uint SECTORS = 0;

struct SkyFactorsPush {
    uint first_point;  // of the bound buffer of the entry points
    uint point_count;  // in it
    uint first_radiance;  // first word of the sky's table in the table of lights
    uint side;            // of the table
    uint channels;        // sets of visible rays of an entry point
    uint channel;         // of these, the one for the light
    uint seed;
};

layout(binding = 0) uniform usamplerBuffer Surfaces;
layout(binding = 1) uniform usamplerBuffer Lights;
layout(binding = 2) uniform usamplerBuffer EntryPoints;
layout(scalar, binding = 3) readonly buffer PathStreams { uint path_streams[]; };  // random stream index of each entry point
layout(scalar, binding = 4) readonly buffer VisibleSky { uint visible_sky[]; };
layout(scalar, binding = 5) writeonly buffer FormFactors { float form_factors[]; };
layout(scalar, push_constant) uniform Push { SkyFactorsPush push; };

#include "include/surfaces.glsl"
#include "include/gather.glsl"
#include "include/sky_rays.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.point_count) return;
    uint stream = path_streams[index];
    vec3 normal = facing_normal(texelFetch(EntryPoints, int(index)).w);
    float sum = 0.0;
    for (uint word = 0u; word < SKY_WORDS; ++word) {
        for (uint rest = visible_sky[SKY_WORDS * (index * push.channels + push.channel) + word]; rest != 0u; rest &= rest - 1u) {
            uint ray = 32u * word + uint(findLSB(rest));
            uint cell = push.side == 1u ? 0u : octahedral_cell(sky_ray(normal, ray, stream, push.seed), push.side);
            sum += number_at(Lights, push.first_radiance + cell);
        }
    }
    form_factors[push.first_point + index] = PI / float(SKY_RAYS) * sum;
}
