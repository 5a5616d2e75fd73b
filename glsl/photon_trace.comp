// Photon tracing: extends every live photon path by up to STEPS surfaces, by BRDF sampling and
// Russian roulette. [Jensen 1996] Deterministic: all decisions come from scrambled Sobol sequences
// over the light's rays, with a fresh scramble a bounce. One invocation = one path. In and out:
// paths. Out: one photon for each surface met, W; unused slots are empty.
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
#include "include/colour.glsl"
#include "include/brdf.glsl"
#include "include/photons.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint STEPS = 0;         // surfaces a path and dispatch
layout(constant_id = 1) const uint MAX_SURVIVAL = 0; // float bits: bound of the survival probability, below 1

struct PhotonPath {
    vec3 origin;
    uint light;
    vec3 direction;  // unit; of no meaning before the first surface
    uint ray;        // index among the light's rays: its random stream index
    vec3 flux;       // W; before the first surface: this ray's fraction of the light's rays
    uint depth;      // surfaces so far
    uint is_alive;   // 0, 1 or LOOP_TRUNCATED
};
struct PhotonTracePush {
    vec3 scene_centre;
    float scene_radius;  // of a sphere around the scene, metres
    uint first_path;     // of this dispatch
    uint end_path;
    uint first_slot;     // of path 0
    uint seed;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 4) uniform usamplerBuffer Lights;
layout(scalar, binding = 5) buffer PhotonPaths { PhotonPath paths[]; };
layout(scalar, binding = 6) writeonly buffer Photons { Photon photons[]; };
layout(scalar, binding = 7) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 8) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 9) readonly buffer Texels { uint texels[]; };
layout(scalar, push_constant) uniform Push { PhotonTracePush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_parts.glsl"
#include "include/emission.glsl"
#include "include/textures.glsl"

float largest(vec3 v) { return max(v.x, max(v.y, v.z)); }

void main() {
    uint index = push.first_path + flat_invocation();
    if (index >= push.end_path) return;
    PhotonPath path = paths[index];
    uint stream = hash(push.seed, path.light);
    if (path.depth == 0u) {
        vec3 u = sample_3d(path.ray, hash(stream, 0u));
        vec3 v = sample_3d(path.ray, hash(stream, 1u));
        LightSource light = chosen_part(light_at(Lights, path.light), u.z);
        EmittedRay ray = emit(light, push.scene_centre, push.scene_radius, u.xy, v);
        // An area light may lie in the plane of a wall.
        vec3 axis = dot(light.axis, ray.direction) < 0.0 ? -light.axis : light.axis;
        path.origin = light.kind == LIGHT_AREA ? offset_origin(ray.origin, axis) : ray.origin;
        path.direction = ray.direction;
        path.flux *= ray.flux;
    }
    uint slot = push.first_slot + index * STEPS;
    uint count = 0u;
    bool alive = largest(path.flux) > 0.0;
    while (alive && count < STEPS) {
        Hit hit;
        if (!trace(Ray(path.origin, path.direction, 1e30), false, hit)) { alive = false; break; }
        path.flux *= passed_by_panes(Ray(path.origin, path.direction, hit.t));
        Surface surface = surface_at(hit.triangle);
        Reflectance material = materials[surface.material];
        bool back = dot(surface.normal, path.direction) > 0.0;
        vec3 normal = back ? -surface.normal : surface.normal;
        vec3 position = hit_position(hit);
        // Irradiance matters only where an albedo multiplies it; neighbours of a black texel
        // need it, too.
        uint side = largest(material.diffuse) > 0.0 ? 2u * hit.triangle + uint(back) : NO_SIDE;
        photons[slot + count] = Photon(position, side, path.flux);
        if (HAS_TEXTURES != 0u) material.diffuse *= image_at(surface.material, hit.triangle, hit.barycentric);
        ++count;
        ++path.depth;

        // Flux stays nearly constant; the absorbed fraction of paths ends.
        vec3 u = sample_3d(path.ray, hash(stream, 1u + path.depth));
        BrdfSample next = sample_brdf(material, normal, -path.direction, u.xy);
        vec3 reflected = path.flux * next.weight;
        float survival = min(uintBitsToFloat(MAX_SURVIVAL), largest(reflected) / largest(path.flux));
        if (!(u.z < survival)) { alive = false; break; }
        path.flux = reflected / survival;
        path.direction = next.incident;
        path.origin = offset_origin(position, normal);
    }
    for (; count < STEPS; ++count) {
        photons[slot + count] = Photon(vec3(0.0), NO_SIDE, vec3(0.0));
    }
    path.is_alive = loops_completed(push.end_path) ? uint(alive) : LOOP_TRUNCATED;
    paths[index] = path;
}
