// First reflection at entry points that may shine: it depends on where the light stands, so that it cannot be a constant of the
// path. [Yue §1] Deterministic. One invocation = one such entry point. In: form factors (1/m²), lights.
// Out: light from each light (W), with the direction in which a mirror would send it on; the flux that the path carries on (W).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/brdf.glsl"
#include "include/gloss.glsl"

layout(local_size_x = 64) in;

struct GlossEntriesPush {
    uint entry_count;
    uint light_count;
    uint path_count;
    float area_m2;  // that each entry point stands for, in the mean
};

layout(scalar, binding = 0) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 1) readonly buffer Lights { LightSource lights[]; };
layout(scalar, binding = 2) readonly buffer FormFactors { float form_factors[]; };
layout(scalar, binding = 3) readonly buffer GlossEntries { GlossEntry gloss_entries[]; };
layout(scalar, binding = 4) writeonly buffer GlossBeams { GlossBeam gloss_beams[]; };  // light_count an entry point
layout(scalar, binding = 5) writeonly buffer ReflectedFlux { vec3 reflected_flux[]; };
layout(scalar, push_constant) uniform Push { GlossEntriesPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.entry_count) return;
    GlossEntry entry = gloss_entries[index];
    Reflectance material = materials[entry.material];
    vec3 reflected = vec3(0.0);
    for (uint i = 0u; i < push.light_count; ++i) {
        vec3 flux = push.area_m2 * form_factors[i * push.path_count + entry.path] * lights[i].emission;
        vec3 travel = normalize(entry.position - lights[i].position);
        vec3 mirror = reflect(travel, entry.normal);
        gloss_beams[index * push.light_count + i] = GlossBeam(mirror, entry.weight * flux);
        reflected += flux * reflected_share(material, off_mirror(mirror, entry.departure));
    }
    reflected_flux[entry.path] = reflected;
}
