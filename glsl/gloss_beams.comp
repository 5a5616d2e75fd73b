// Beams of one light at the entry points that may be glossy, one for each point sample of the
// light. Samples of a light of many parts share beams. The first reflection depends on the
// direction of incidence, so it cannot be a constant of the path. [Yue §1] Deterministic. One
// invocation = one beam at one entry point. In: entry points, a light, its form factors. Out: beams
// per unit emission.
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
#include "include/gloss.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint TRACES = 1;  // 0: a light of one point sample, whose form factor is that of its ray

struct GlossBeamsPush {
    uint entry_count;
    uint light;       // its first part
    uint beam_count;  // of an entry point
    uint part_beams;  // the first of them, which this dispatch writes
    uint sample_count;      // of all parts
    uint samples_per_beam;
    float area_m2;    // mean area of an entry point
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Lights;
layout(scalar, binding = 3) readonly buffer GlossEntries { GlossEntry gloss_entries[]; };
layout(scalar, binding = 4) writeonly buffer GlossBeams { GlossBeam gloss_beams[]; };  // entry point by entry point
layout(scalar, binding = 5) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, binding = 6) readonly buffer FormFactors { float form_factors[]; };  // of the light, of all entry points
layout(scalar, push_constant) uniform Push { GlossBeamsPush push; };

#include "include/triangles.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/direct.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.entry_count * push.part_beams) return;
    uint entry_index = index / push.part_beams;
    uint beam_index = index % push.part_beams;
    GlossEntry entry = gloss_entries[entry_index];
    // All parts have as many samples.
    uint samples = light_at(Lights, push.light).samples;
    uint first = beam_index * push.samples_per_beam;
    uint end = min(first + push.samples_per_beam, push.sample_count);
    GlossBeam beam = GlossBeam(entry.normal, 0.0);
    vec3 toward = vec3(0.0);
    for (uint i = first; i < end; ++i) {
        LightSource light = light_at(Lights, push.light + i / samples);
        uint number = i % samples;
        LightSample found;
        if (!sample_light(light, entry.position, lattice_point(light, number), found)) continue;
        float factor = TRACES == 0u ? form_factors[entry.path] : 0.0;
        if (TRACES == 1u) {
            factor = light_factor(light, number, number + 1u, 0u, entry.position, entry.normal, entry.normal, push.area_m2);
            factor = light.relative * weighed(light, light.samples, factor, entry.position, entry.normal, push.area_m2);
        }
        toward = push.samples_per_beam == 1u ? found.direction : toward + factor * found.direction;
        beam.factor += factor;
    }
    if (toward != vec3(0.0)) {
        if (push.samples_per_beam > 1u) toward = normalize(toward);
        beam.mirror = reflect(-toward, entry.normal);
    }
    gloss_beams[entry_index * push.beam_count + beam_index] = beam;
    if (!loops_completed(push.entry_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
