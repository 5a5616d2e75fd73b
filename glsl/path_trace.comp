// Path tracing with next-event estimation to every light and Russian roulette: the reference.
// [Kajiya 1986] Deterministic. One invocation = one pixel; a dispatch extends its paths by `rounds`
// vertices. A lane whose path ends starts its next sample in the next round, so that it does not
// wait for neighbours with longer paths. In: camera, scene, lights. In and out: sums of radiance
// (W/m²/sr) over samples, and the state of the paths.
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

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint ROULETTE_THRESHOLD = 0;  // float bits: roulette starts below this throughput

const uint TILE = 8u;  // a workgroup is a square of TILE × TILE pixels

// A compensated sum: the rounded value and the rest.
struct RadianceSum {
    vec3 high;
    vec3 low;
};
struct SampleMoments {
    vec3 squares;  // sum over the samples of their squared distance from the mean of all
    uint rays;     // camera, shadow and reflected rays so far
};
// A path in progress.
struct TracedPath {
    vec3 origin;
    vec3 direction;
    vec3 throughput;    // product of brdf·cosθ/pdf so far, roulette included
    vec3 direct;        // radiance found so far: reflected once
    vec3 indirect;      // reflected several times, or once from the sky
    uint depth;         // vertices so far
    uint sample_index;  // index of its random numbers: the number of finished samples
};
struct PathTracePush {
    View view;
    uint light_count;
    uint seed;
    uint first_tile;    // tiles are numbered row by row
    uint tile_count;
    uint first_sample;  // first sample; RESUME: paths continue from their state
    uint goal;          // one past the last sample
    uint rounds;
};

const uint RESUME = 0xffffffffu;

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer Materials { Reflectance materials[]; };
layout(binding = 4) uniform usamplerBuffer Lights;
layout(scalar, binding = 5) buffer DirectSums { RadianceSum direct_sums[]; };
layout(scalar, binding = 6) buffer IndirectSums { RadianceSum indirect_sums[]; };
layout(scalar, binding = 7) buffer Moments { SampleMoments sample_moments[]; };
layout(scalar, binding = 8) buffer TracedPaths { TracedPath traced_paths[]; };
layout(scalar, binding = 9) buffer Unfinished { uint unfinished[]; };  // number of pixels that have not reached the goal; or LOOP_TRUNCATED
layout(scalar, binding = 10) readonly buffer TextureCoordinates { vec2 texture_coordinates[]; };
layout(scalar, binding = 11) readonly buffer Textures { Texture textures[]; };
layout(scalar, binding = 12) readonly buffer Texels { uint texels[]; };
layout(scalar, binding = 13) readonly buffer Emitted { vec4 emitted[]; };
layout(scalar, binding = 14) readonly buffer Backgrounds { Background background[]; };  // one
layout(scalar, binding = 15) readonly buffer SkyTexels { vec3 sky_texels[]; };
layout(scalar, push_constant) uniform Push { PathTracePush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/receivers.glsl"
#include "include/emitted.glsl"
#include "include/sky.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_parts.glsl"
#include "include/brdf.glsl"
#include "include/textures.glsl"
#include "include/path.glsl"

// Adds with twice the digits: `high` is the rounded sum, `low` the rest. [Knuth §4.2.2]
void add(inout RadianceSum sum, vec3 value) {
    precise vec3 total = sum.high + value;
    precise vec3 added = total - sum.high;
    precise vec3 low = sum.low + ((sum.high - (total - added)) + (value - added));
    precise vec3 high = total + low;
    precise vec3 rest = low - (high - total);
    sum = RadianceSum(high, rest);
}

// Updates the sum of squared deviations; `sum` is that of the `before` samples
// before. [Welford 1962]
void add_to_spread(inout vec3 squares, vec3 value, vec3 sum, float before) {
    vec3 apart = value - sum / max(before, 1.0);
    squares += apart * apart * (before / (before + 1.0));
}

void main() {
    View view = push.view;
    uvec2 pixel = corner_of_tile(push.first_tile + flat_workgroup(), TILE, view.width) + place_in_tile(TILE);
    if (flat_workgroup() >= push.tile_count || pixel.x >= view.width || pixel.y >= view.height) return;
    uint index = pixel.y * view.width + pixel.x;
    uint pixel_seed = hash(push.seed, index);
    RadianceSum direct_sum = direct_sums[index];
    RadianceSum indirect_sum = indirect_sums[index];
    SampleMoments moments = sample_moments[index];

    uint lane = flat_invocation();
    TracedPath path = traced_paths[lane];
    if (push.first_sample != RESUME) {
        path.sample_index = push.first_sample;
        path.depth = 0u;
    }
    for (uint round = 0u; round < push.rounds && path.sample_index != push.goal; ++round) {
        if (path.depth == 0u) {
            vec2 jitter = sample_3d(path.sample_index, pixel_seed).xy;
            vec2 ndc = (vec2(pixel) + jitter) / vec2(view.width, view.height) * 2.0 - 1.0;
            vec3 direction = view.forward + ndc.x * view.right - ndc.y * view.up;
            path = TracedPath(view.position, direction, vec3(1.0), vec3(0.0), vec3(0.0), 0u, path.sample_index);
        }
        Hit hit;
        ++moments.rays;
        bool alive = trace(Ray(path.origin, path.direction, 1e30), false, hit);
        path.throughput *= passed_by_panes(Ray(path.origin, path.direction, alive ? hit.t : 1e30));
        if (alive) {
            Vertex vertex = vertex_at(hit, path.direction, path.depth == 0u);
            uint seed = hash(pixel_seed, path.depth + 1u);
            vec3 gathered;
            vec3 radiance = path.throughput * reflected_light(vertex, path.sample_index, seed, moments.rays, gathered);
            if (path.depth == 0u) {
                path.indirect = path.throughput * gathered;
                path.direct = radiance - path.indirect;
            } else {
                path.indirect += radiance;
            }
            // Later vertices sample emitters as lights.
            if (HAS_EMISSION != 0u && path.depth == 0u) path.direct += path.throughput * emitted_against(hit.triangle, path.direction);

            vec3 u = sample_3d(path.sample_index, seed);
            alive = reflect_path(vertex, u, uintBitsToFloat(ROULETTE_THRESHOLD), path.throughput, path.direction);
            path.origin = offset_origin(vertex.position, vertex.geometric);
            ++path.depth;
        }
        if (HAS_EMISSION != 0u && !alive && path.depth == 0u) path.direct = path.throughput * background_along(path.direction);
        if (!alive) {
            vec3 sum = direct_sum.high + indirect_sum.high;
            add_to_spread(moments.squares, path.direct + path.indirect, sum, float(path.sample_index));
            add(direct_sum, path.direct);
            add(indirect_sum, path.indirect);
            ++path.sample_index;
            path.depth = 0u;
        }
    }
    traced_paths[lane] = path;
    if (path.sample_index != push.goal) atomicAdd(unfinished[0], 1u);
    if (!loops_completed(push.rounds)) atomicOr(unfinished[0], LOOP_TRUNCATED);
    direct_sums[index] = direct_sum;
    indirect_sums[index] = indirect_sum;
    sample_moments[index] = moments;
}
