// First reflection of one light at the entry points that may be glossy: the outgoing flux after the
// first bounce. [Yue §1] Deterministic. One invocation = one such entry point. In: beams. Out:
// flux per unit of the light's emission and of the mean area of an entry point.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"
#include "include/colour.glsl"

layout(local_size_x = 64) in;

struct GlossEntriesPush {
    uint entry_count;
    uint beam_count;  // of an entry point
};

layout(scalar, binding = 0) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 1) readonly buffer GlossEntries { GlossEntry gloss_entries[]; };
layout(scalar, binding = 2) readonly buffer GlossBeams { GlossBeam gloss_beams[]; };
layout(scalar, binding = 3) writeonly buffer FirstBounceFlux { vec3 first_bounce_flux[]; };
layout(scalar, push_constant) uniform Push { GlossEntriesPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.entry_count) return;
    GlossEntry entry = gloss_entries[index];
    Reflectance material = materials[entry.material];
    if (HAS_TEXTURES != 0u) material.diffuse *= unpack_colour(entry.colour);
    vec3 first_bounce = vec3(0.0);
    for (uint i = index * push.beam_count; i < (index + 1u) * push.beam_count; ++i) {
        first_bounce += gloss_beams[i].factor * reflected_fraction(material, off_mirror(gloss_beams[i].mirror, entry.departure));
    }
    first_bounce_flux[entry.path] = first_bounce;
}
