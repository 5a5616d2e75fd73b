// Path tracing with next-event estimation to every light and Russian roulette: the reference. [Kajiya 1986] Deterministic.
// One invocation = one pixel, which takes a run of samples. In: camera, scene, lights. In and out: sums of radiance
// (W/m²/sr) over samples. A lane whose path ends begins its next sample in the same round, so that neighbours with longer
// paths do not leave it idle.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ROULETTE_THRESHOLD = 0;  // float bits: roulette starts below this throughput

const uint TILE = 8u;  // a workgroup is a square of TILE × TILE pixels

// A sum and what rounding took from it.
struct RadianceSum {
    vec3 high;
    vec3 low;
};
struct SampleMoments {
    vec3 squares;  // sum over the samples of their squared distance from the mean of all
    uint rays;     // camera, shadow and reflected rays so far
};
struct PathTracePush {
    View view;
    uint light_count;
    uint seed;
    uint first_tile;    // tiles are numbered row by row
    uint tile_count;
    uint first_sample;  // how many samples each pixel has had
    uint sample_count;
};

layout(scalar, binding = 0) readonly buffer Nodes { Node nodes[]; };
layout(scalar, binding = 1) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar, binding = 2) readonly buffer Surfaces { Surface surfaces[]; };
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(scalar, binding = 4) readonly buffer Lights { LightSource lights[]; };
layout(scalar, binding = 5) buffer DirectSums { RadianceSum direct_sums[]; };
layout(scalar, binding = 6) buffer IndirectSums { RadianceSum indirect_sums[]; };
layout(scalar, binding = 7) buffer Moments { SampleMoments sample_moments[]; };
layout(scalar, push_constant) uniform Push { PathTracePush push; };

#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/brdf.glsl"

// Exact: high + low is the sum as long as low itself does not round. [Knuth 4.2.2]
void add(inout RadianceSum sum, vec3 value) {
    precise vec3 total = sum.high + value;
    precise vec3 added = total - sum.high;
    precise vec3 lost = (sum.high - (total - added)) + (value - added);
    sum = RadianceSum(total, sum.low + lost);
}

struct Vertex {
    vec3 position;
    vec3 geometric;  // unit normal on the visible side
    vec3 shading;    // the interpolated one at the first vertex, else the geometric one
    vec3 outgoing;   // unit, towards where the path came from
    Reflectance material;
};

Vertex vertex_at(Hit hit, vec3 direction, bool is_first) {
    Surface surface = surfaces[hit.triangle];
    float side = dot(surface.normal, direction) > 0.0 ? -1.0 : 1.0;
    vec3 smooth_normal = hit.barycentric.x * surface.n0 + hit.barycentric.y * surface.n1 + hit.barycentric.z * surface.n2;
    vec3 shading = is_first ? normalize(smooth_normal) : surface.normal;
    return Vertex(hit_position(hit), side * surface.normal, side * shading, -normalize(direction), materials[surface.material]);
}

// Radiance that a vertex reflects of what the lights send there directly, W/m²/sr.
vec3 reflected_light(Vertex vertex, uint sample_index, uint seed, inout uint rays) {
    vec3 radiance = vec3(0.0);
    for (uint i = 0u; i < push.light_count; ++i) {
        LightSource light = lights[i];
        vec2 u = vec2(0.0);
        // A loop that turns once, which lavapipe skips where a branch would be taken by all.
        for (bool is_due = light.kind == LIGHT_AREA; is_due; is_due = false) u = sample_3d(sample_index, hash(seed, ~i)).xy;
        LightSample found;
        if (!sample_light(light, vertex.position, u, found)) continue;
        float cosine = dot(vertex.shading, found.direction);
        // A light behind the real surface does not shine through, wherever the shading normal points.
        if (cosine <= 0.0 || dot(vertex.geometric, found.direction) <= 0.0) continue;
        vec3 reflected = brdf(vertex.material, vertex.shading, vertex.outgoing, found.direction) * found.irradiance;
        if (reflected == vec3(0.0)) continue;
        ++rays;
        if (is_lit(vertex.position, vertex.geometric, found)) radiance += cosine * reflected;
    }
    return radiance;
}

// Enters a sample into the running spread; `sum` holds the `before` samples before it. [Welford 1962]
void add_to_spread(inout vec3 squares, vec3 value, vec3 sum, float before) {
    vec3 apart = value - sum / max(before, 1.0);
    squares += apart * apart * (before / (before + 1.0));
}

void main() {
    View view = push.view;
    uint tile = push.first_tile + flat_workgroup();
    uint across = (view.width + TILE - 1u) / TILE;
    uvec2 inside = uvec2(gl_LocalInvocationIndex % TILE, gl_LocalInvocationIndex / TILE);
    uvec2 pixel = TILE * uvec2(tile % across, tile / across) + inside;
    if (flat_workgroup() >= push.tile_count || pixel.x >= view.width || pixel.y >= view.height) return;
    uint index = pixel.y * view.width + pixel.x;
    uint pixel_seed = hash(push.seed, index);
    RadianceSum direct_sum = direct_sums[index];
    RadianceSum indirect_sum = indirect_sums[index];
    SampleMoments moments = sample_moments[index];

    const float threshold = uintBitsToFloat(ROULETTE_THRESHOLD);
    uint sample_index = push.first_sample;
    uint depth = 0u;  // vertices of the path so far
    vec3 origin, direction, throughput, direct, indirect;
    while (sample_index != push.first_sample + push.sample_count) {
        if (depth == 0u) {
            vec2 jitter = sample_3d(sample_index, pixel_seed).xy;
            vec2 ndc = (vec2(pixel) + jitter) / vec2(view.width, view.height) * 2.0 - 1.0;
            origin = view.position;
            direction = view.forward + ndc.x * view.right - ndc.y * view.up;
            throughput = vec3(1.0);
            direct = vec3(0.0);
            indirect = vec3(0.0);
        }
        Hit hit;
        ++moments.rays;
        bool alive = trace(Ray(origin, direction, 1e30), false, hit);
        if (alive) {
            Vertex vertex = vertex_at(hit, direction, depth == 0u);
            uint seed = hash(pixel_seed, depth + 1u);
            vec3 radiance = throughput * reflected_light(vertex, sample_index, seed, moments.rays);
            if (depth == 0u) direct = radiance; else indirect += radiance;

            vec3 u = sample_3d(sample_index, seed);
            BrdfSample next = sample_brdf(vertex.material, vertex.shading, vertex.outgoing, u.xy);
            // Where the shading normal leans away from the geometric one, part of its hemisphere lies inside the surface.
            throughput *= dot(vertex.geometric, next.incident) > 0.0 ? next.weight : vec3(0.0);
            // The path goes on with a probability that falls with its throughput; dividing by it keeps the estimate right.
            float survival = min(1.0, max(throughput.x, max(throughput.y, throughput.z)) / threshold);
            alive = u.z < survival;
            throughput /= max(survival, 1e-30);
            origin = offset_origin(vertex.position, vertex.geometric);
            direction = next.incident;
            ++depth;
        }
        if (!alive) {
            vec3 sum = direct_sum.high + indirect_sum.high;
            add_to_spread(moments.squares, direct + indirect, sum, float(sample_index));
            add(direct_sum, direct);
            add(indirect_sum, indirect);
            ++sample_index;
            depth = 0u;
        }
    }
    direct_sums[index] = direct_sum;
    indirect_sums[index] = indirect_sum;
    sample_moments[index] = moments;
}
