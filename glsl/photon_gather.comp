// Final gathering of the photon map: one gather ray a sample, which ends at an irradiance point.
// [Jensen 1996] A ray is scattered again if it is too short for the map's resolution or finds no
// irradiance point; so is light that a Phong lobe reflects. Deterministic. One invocation = one
// pixel. In: camera, irradiance points. Out: sums over samples, W/m²/sr.
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

// Sums and their rounding errors.
struct GatherSums {
    vec3 direct;
    vec3 direct_lost;
    vec3 indirect;
    vec3 indirect_lost;
};
struct PhotonGatherPush {
    View view;
    PhotonGrid grid;     // of the irradiance points
    uint light_count;
    uint first_pixel;
    uint end_pixel;
    uint first_sample;
    uint sample_count;
    float radius;        // of the density estimate, metres
    uint seed;
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 4) uniform usamplerBuffer Lights;
layout(scalar, binding = 5) readonly buffer Points { MapEntry points[]; };
layout(scalar, binding = 6) readonly buffer EntryOffsets { uint entry_offsets[]; };
layout(scalar, binding = 7) readonly buffer Reaches { uvec4 reaches[]; };
layout(scalar, binding = 8) readonly buffer Irradiances { vec3 irradiances[]; };
layout(scalar, binding = 9) buffer PixelSums { GatherSums pixel_sums[]; };
layout(scalar, binding = 10) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, binding = 11) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 12) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 13) readonly buffer Texels { uint texels[]; };
layout(scalar, binding = 14) readonly buffer Emitted { vec4 emitted[]; };
layout(scalar, binding = 15) readonly buffer Backgrounds { Background background[]; };  // one
layout(scalar, binding = 16) readonly buffer SkyTexels { vec3 sky_texels[]; };
layout(scalar, push_constant) uniform Push { PhotonGatherPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/emitted.glsl"
#include "include/sky.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_parts.glsl"
#include "include/textures.glsl"

struct Vertex {
    vec3 position;
    Receiver receiver;  // takes direct light
    vec3 normal;    // geometric, on the visible side
    vec3 shading;   // the normal to shade with
    vec3 outgoing;  // towards the viewer
    Reflectance material;
};

float largest(vec3 v) { return max(v.x, max(v.y, v.z)); }

// The nearest irradiance point on a surface point's surface, or NO_ENTRY. Searches the eight
// nearest cells, then one cell further on each side. A distance off the plane counts four times; a
// turned normal adds to the distance.
uint nearest_point(vec3 position, vec3 normal) {
    ivec3 corner = photon_cell(push.grid, position - 0.5 / push.grid.inverse_cell);
    uint nearest = NO_ENTRY;
    float least = 1e30;
    for (int width = 2; width <= 4 && nearest == NO_ENTRY; width += 2) {
        for (int i = 0; i < width * width * width; ++i) {
            ivec3 cell = corner + ivec3(i % width, i / width % width, i / (width * width)) - (width / 2 - 1);
            uint bucket = photon_bucket(cell);
            for (uint j = entry_offsets[bucket]; j < entry_offsets[bucket + 1u]; ++j) {
                MapEntry point = points[j];
                vec3 offset = position - point.position;
                float turned = 1.0 - dot(normal, point.normal);
                float above = dot(offset, normal);
                float apart = dot(offset, offset) + 16.0 * above * above + push.radius * push.radius * turned;
                if (turned > 0.75 || apart >= least) continue;
                // A bucket may hold points of several cells; skips those of far ones.
                if (photon_cell(push.grid, point.position) != cell) continue;
                if (!is_within_reach(reaches[j], point.normal, offset, push.radius)) continue;
                least = apart;
                nearest = j;
            }
        }
    }
    return nearest;
}

// Reflected direct light along `outgoing`, with one shadow ray a light. `gathered` is the part that
// frames find by gather rays: diffuse reflection of the sky without its bright spots.
vec3 direct_light(Vertex vertex, Reflectance material, uint ray, uint seed, out vec3 gathered) {
    Receiver at = vertex.receiver;
    vec3 sum = vec3(0.0);
    gathered = vec3(0.0);
    // A black material reflects nothing and takes no shadow ray.
    uint count = largest(material.diffuse + material.specular) > 0.0 ? push.light_count : 0u;
    for (uint i = 0u; i < count; ++i) {
        vec3 u = sample_3d(ray, hash(seed, i));
        LightSource light = chosen_part(light_at(Lights, i), u.z);
        LightSample found;
        if (!sample_light(light, at.position, u.xy, found)) continue;
        float cosine = dot(vertex.shading, found.direction);
        if (cosine <= 0.0 || dot(at.normal, found.direction) <= 0.0) continue;
        if (!is_lit(at.position, at.normal, found)) continue;
        found.irradiance *= passed_by_panes(shadow_ray(at.position, at.normal, found));
        sum += brdf(material, vertex.shading, vertex.outgoing, found.direction) * found.irradiance * cosine;
        if (light.kind == LIGHT_SKY) gathered += light.edge_v.x * cosine / PI * material.diffuse * found.irradiance;
    }
    return sum;
}

Vertex vertex_at(Hit hit, vec3 direction, bool smooth_normal) {
    Surface surface = surface_at(hit.triangle);
    bool is_back = dot(surface.normal, direction) > 0.0;
    vec3 normal = is_back ? -surface.normal : surface.normal;
    vec3 shading = normal;
    vec3 position = hit_position(hit);
    Receiver receiver = Receiver(position, normal);
    if (smooth_normal) {
        shading = normalize(hit.barycentric.x * surface.n0 + hit.barycentric.y * surface.n1 + hit.barycentric.z * surface.n2);
        if (is_back) shading = -shading;
        receiver = receiver_at(position, 2u * hit.triangle + uint(is_back), shading);
    }
    Reflectance material = materials[surface.material];
    if (HAS_TEXTURES != 0u) material.diffuse *= image_at(surface.material, hit.triangle, hit.barycentric);
    return Vertex(position, receiver, normal, shading, -direction, material);
}

// Radiance that the visible surface reflects of light from other surfaces.
vec3 indirect_light(Vertex vertex, uint ray, uint seed) {
    vec3 sum = vec3(0.0);
    vec3 throughput = vec3(1.0);
    for (uint depth = 1u; ; ++depth) {
        vec3 u = sample_3d(ray, hash(seed, 2u * depth));
        BrdfSample next = sample_brdf(vertex.material, vertex.shading, vertex.outgoing, u.xy);
        throughput *= next.weight;
        float survival = depth == 1u ? 1.0 : min(0.95, largest(throughput));
        if (!(u.z < survival) || largest(throughput) <= 0.0 || dot(vertex.normal, next.incident) <= 0.0) break;
        throughput /= survival;
        Hit hit;
        vec3 origin = offset_origin(vertex.position, vertex.normal);
        if (!trace(Ray(origin, next.incident, 1e30), false, hit)) break;
        throughput *= passed_by_panes(Ray(origin, next.incident, hit.t));
        vertex = vertex_at(hit, next.incident, false);
        uint point = hit.t > push.radius ? nearest_point(vertex.position, vertex.normal) : NO_ENTRY;
        if (point != NO_ENTRY) {
            sum += throughput * vertex.material.diffuse * irradiances[point] / PI;
            vertex.material.diffuse = vec3(0.0);
            if (largest(vertex.material.specular) <= 0.0) break;
        }
        vec3 gathered;
        sum += throughput * direct_light(vertex, vertex.material, ray, hash(seed, 2u * depth + 1u), gathered);
    }
    return sum;
}

// Adds with compensation of the rounding error. [Kahan 1965]
void add(inout vec3 sum, inout vec3 lost, vec3 value) {
    precise vec3 term = value - lost;
    precise vec3 total = sum + term;
    precise vec3 rounded = (total - sum) - term;
    sum = total;
    lost = rounded;
}

void main() {
    uint index = push.first_pixel + flat_invocation();
    if (index >= push.end_pixel) return;
    uvec2 pixel = in_rows(index, push.view.width);
    uint seed = hash(push.seed, index);
    GatherSums sums = pixel_sums[index];
    for (uint i = 0u; i < push.sample_count; ++i) {
        uint ray = push.first_sample + i;
        vec2 place = vec2(pixel) + sample_3d(ray, hash(seed, 0u)).xy;
        vec2 ndc = place / vec2(push.view.width, push.view.height) * 2.0 - 1.0;
        vec3 direction = normalize(push.view.forward + ndc.x * push.view.right - ndc.y * push.view.up);
        Hit hit;
        bool is_hit = trace(Ray(push.view.position, direction, 1e30), false, hit);
        vec3 passed = passed_by_panes(Ray(push.view.position, direction, is_hit ? hit.t : 1e30));
        if (!is_hit) {
            if (HAS_EMISSION != 0u) add(sums.direct, sums.direct_lost, passed * background_along(direction));
            continue;
        }
        Vertex seen = vertex_at(hit, direction, true);
        if (HAS_EMISSION != 0u) add(sums.direct, sums.direct_lost, passed * emitted_against(hit.triangle, direction));
        vec3 gathered;
        vec3 direct = direct_light(seen, seen.material, ray, hash(seed, 1u), gathered);
        add(sums.direct, sums.direct_lost, passed * (direct - gathered));
        add(sums.indirect, sums.indirect_lost, passed * (gathered + indirect_light(seen, ray, seed)));
    }
    pixel_sums[index] = sums;
    if (!loops_completed(push.sample_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
