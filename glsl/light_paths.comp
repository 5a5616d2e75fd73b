// Light paths: extends every live path by up to STEPS vertices, with Russian roulette. Directions
// are importance sampled by the reflection, or by the cosine alone if the material is editable or
// the light is not known yet. [Yue §1] Deterministic: directions and roulette come from one
// scrambled Sobol sequence over the paths, with a fresh scramble a bounce. One invocation =
// one live path. In and out: path states. Out: vertices and their number.
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
#include "include/colour.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint STEPS = 0;                 // vertices per path and dispatch
layout(constant_id = 1) const uint ROULETTE_THRESHOLD = 0;    // float bits: roulette starts below this throughput
layout(constant_id = 2) const uint EDITABLE_ALBEDO = 0;       // float bits: albedo of editable materials in the roulette
layout(constant_id = 3) const uint IS_GLOSSY = 0;                // 1: a material of the scene has a Phong lobe or may get one

struct PathState {
    vec3 position;
    uint side;
    vec3 throughput;  // product of f·cosθ/pdf so far, roulette included
    vec3 incoming;    // unit direction of travel when it arrived; zero at an entry point
    uint path;        // path index
    uint stream;      // random stream index
    uint depth;       // vertices so far
    uint is_alive;
};
struct LightPathsPush {
    Grid grid;
    uint path_count;
    uint seed;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 4) readonly buffer Octree { uint octree[]; };
layout(scalar, binding = 5) readonly buffer CellClusters { uint cell_clusters[]; };
layout(scalar, binding = 6) readonly buffer Guides { Guide guides[]; };
layout(scalar, binding = 7) buffer Paths { PathState paths[]; };
layout(scalar, binding = 8) writeonly buffer Vertices { PathVertex vertices[]; };      // STEPS a path
layout(scalar, binding = 9) writeonly buffer VertexCounts { uint vertex_counts[]; };
layout(scalar, binding = 10) writeonly buffer VertexColours { uint vertex_colours[]; };  // of the vertex before, packed; STEPS a path
layout(scalar, binding = 11) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 12) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 13) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { LightPathsPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/grid.glsl"
#include "include/textures.glsl"
#include "include/guides.glsl"

void main() {
    uint index = flat_invocation();
    if (index >= push.path_count) return;
    PathState state = paths[index];
    const float threshold = uintBitsToFloat(ROULETTE_THRESHOLD);
    uint count = 0u;
    bool alive = true;
    while (count < STEPS) {
        vec3 u = sample_3d(state.stream, hash(push.seed, state.depth));
        Surface surface = surface_at(state.side >> 1);
        vec3 normal = (state.side & 1u) != 0u ? -surface.normal : surface.normal;

        // Lambert with a cosine-sampled direction: f·cosθ/pdf is the albedo.
        Reflectance material = materials[surface.material];
        vec3 colour = vec3(1.0);
        if (HAS_TEXTURES != 0u) {
            uint triangle = state.side >> 1;
            colour = image_at(surface.material, triangle, barycentric_at(triangle, state.position));
            material.diffuse *= colour;
        }
        float weight = 1.0;
        vec3 direction = HAS_REGIONS == 0u ? frame_around(normal) * sample_cosine(u.xy) : guided_direction(state.position, normal, u.xy, weight);
        float guided = weight;
        vec3 reflected = material.diffuse;
        float lobe = 0.0;
        if (IS_GLOSSY == 1u && (material.flags & MAY_BE_GLOSSY) != 0u) {
            bool is_editable = (material.flags & EDITABLE) != 0u;
            reflected = is_editable ? vec3(uintBitsToFloat(EDITABLE_ALBEDO)) : material.diffuse + material.specular;
            if (state.depth > 0u) {
                if (!is_editable) {
                    BrdfSample found = sample_brdf(material, normal, -state.incoming, u.xy);
                    guided = 1.0;
                    direction = found.incident;
                    reflected = found.weight;
                    weight = dot(normal, direction) / (PI * max(found.pdf, 1e-30));
                }
                lobe = off_mirror(reflect(state.incoming, normal), direction);
            }
        }
        // True also if a sampled lobe direction points below the surface.
        if (!(max(reflected.x, max(reflected.y, reflected.z)) > 0.0) || weight == 0.0) { alive = false; break; }
        // Russian roulette: the survival probability falls with the throughput; dividing by it
        // keeps the estimate unbiased.
        state.throughput *= reflected;
        float peak = max(state.throughput.x, max(state.throughput.y, state.throughput.z));
        float nominal = HAS_REGIONS == 0u ? 1.0 : nominal_weight(state.position);
        float survival = min(1.0, peak / (threshold * nominal));
        if (!(u.z < survival)) { alive = false; break; }
        state.throughput /= survival;
        if (HAS_REGIONS != 0u) state.throughput *= guided;

        Hit hit;
        vec3 origin = offset_origin(state.position, normal);
        if (!trace(Ray(origin, direction, 1e30), false, hit)) { alive = false; break; }
        vec3 passed = passed_by_panes(Ray(origin, direction, hit.t));
        state.throughput *= passed;

        Surface found = surface_at(hit.triangle);
        bool back = dot(found.normal, direction) > 0.0;
        state.position = hit_position(hit);
        state.side = 2u * hit.triangle + uint(back);
        state.incoming = direction;
        vec3 found_normal = back ? -found.normal : found.normal;
        uint cluster = base_cluster(cell_at(push.grid, state.position, found_normal), side_code(found.sides, back), state.position);
        vertices[index * STEPS + count] = PathVertex(state.position, state.side, direction, weight / survival, cluster, lobe);
        if (HAS_TEXTURES != 0u) vertex_colours[index * STEPS + count] = pack_colour(passed * colour);
        ++count;
        ++state.depth;
    }
    state.is_alive = uint(alive);
    paths[index] = state;
    vertex_counts[index] = loops_completed(push.path_count) ? count : LOOP_TRUNCATED;
}
