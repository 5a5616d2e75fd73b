// Sky visibility: which rays of each entry point leave the scene. They do not depend on the sky.
// Deterministic. One invocation = 32 rays of one entry point, for one colour. In: entry points,
// scene. Out: a bit a ray, set if it leaves; a set of bits for each channel if panes have colours.
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

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint RINGS = 0;
layout(constant_id = 1) const uint SECTORS = 0;

struct SkyVisibilityPush {
    uint first_word;   // of this dispatch, in the bound buffer
    uint word_count;
    uint channels;     // 1: of all colours; or 3
    uint seed;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(binding = 3) uniform usamplerBuffer EntryPoints;
layout(scalar, binding = 4) readonly buffer PathStreams { uint path_streams[]; };  // random stream index of each entry point
layout(scalar, binding = 5) writeonly buffer VisibleSky { uint visible_sky[]; };
layout(scalar, binding = 6) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { SkyVisibilityPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/gather.glsl"
#include "include/sky_rays.glsl"

void main() {
    if (flat_invocation() >= push.word_count) return;
    uint word = push.first_word + flat_invocation();
    uint index = word / (SKY_WORDS * push.channels);
    uint channel = push.channels == 1u ? 0u : 1u + word / SKY_WORDS % 3u;
    uvec4 point = texelFetch(EntryPoints, int(index));  // position; side
    vec3 normal = facing_normal(point.w);
    vec3 origin = offset_origin(uintBitsToFloat(point.xyz), normal);
    uint stream = path_streams[index];
    uint visible = 0u;
    for (uint bit = 0u; bit < 32u; ++bit) {
        uint ray = 32u * (word % SKY_WORDS) + bit;
        Ray towards = Ray(origin, sky_ray(normal, ray, stream, push.seed), 1e30);
        Hit hit;
        if (trace(towards, true, hit)) continue;
        // Panes stop a fraction of the rays.
        float passed = passed_by_panes(towards, channel);
        if (HAS_PANES == 0u || unit_float(hash(ray, hash(stream, ~push.seed))) < passed) visible |= 1u << bit;
    }
    visible_sky[word] = visible;
    if (!loops_completed(push.word_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
