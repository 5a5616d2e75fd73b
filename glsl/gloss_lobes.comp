// Phong lobes of the path vertices in glossy clusters: what all outgoing directions of a cluster
// have in common, for one light. [Yue §2] Deterministic. One invocation = one vertex. In:
// contributions, outgoing flux after the first bounce. Out: lobes: π times the flux at the lobe's
// peak, W per unit of the light's emission (at entry points per unit of irradiance); exponent.
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

layout(local_size_x = 64) in;

struct GlossLobesPush {
    uint entry_count;   // vertices that are entry points; they come first
    uint vertex_count;  // all
    float area_m2;      // mean area of an entry point
};

layout(binding = 0) uniform usamplerBuffer Materials;
layout(binding = 1) uniform usamplerBuffer Contributions;
layout(scalar, binding = 2) readonly buffer GlossVertices { GlossVertex gloss_vertices[]; };
layout(binding = 3) uniform usamplerBuffer FirstBounceFlux;  // three floats a path
layout(scalar, binding = 4) writeonly buffer GlossLobes { vec4 gloss_lobes[]; };
layout(scalar, push_constant) uniform Push { GlossLobesPush push; };

void main() {
    uint index = flat_invocation();
    if (index >= push.vertex_count) return;
    GlossVertex vertex = gloss_vertices[index];
    Reflectance material = reflectance_at(Materials, vertex.material);
    Contribution contribution = contribution_at(Contributions, vertex.contribution & ~UNWEIGHTED);
    bool is_unweighted = (vertex.contribution & UNWEIGHTED) != 0u;
    vec3 flux = push.area_m2 * contribution_weight(contribution, is_unweighted) * contribution.throughput;
    if (index >= push.entry_count) flux *= uintBitsToFloat(triple_at(FirstBounceFlux, path_of(contribution)));
    gloss_lobes[index] = vec4(0.5 * (material.exponent + 2.0) * material.specular * flux, material.exponent);
}
