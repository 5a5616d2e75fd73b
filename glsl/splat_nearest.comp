// Splatting, step 4: a pixel that no record covers takes the one that fits it best, of all there are. Deterministic: of
// equal ones the first. One workgroup = one pixel at a time. In: bare pixels, records. Out: the pixel's only weight.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/splat.glsl"

layout(local_size_x = 256) in;

struct SplatNearestPush {
    uint record_count;
    uint weight_capacity;
};

layout(binding = 0) uniform usamplerBuffer Pixels;
layout(binding = 1) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 2) readonly buffer WeightRuns { WeightRun weight_runs[]; };
layout(scalar, binding = 3) readonly buffer Tally { SplatTally tally; };
layout(scalar, binding = 4) readonly buffer BarePixels { uint bare_pixels[]; };
layout(scalar, binding = 5) writeonly buffer Weights { SplatWeight weights[]; };
layout(scalar, push_constant) uniform Push { SplatNearestPush push; };

shared SplatWeight best[gl_WorkGroupSize.x];

bool is_better(SplatWeight a, SplatWeight b) {
    return a.weight > b.weight || (a.weight == b.weight && a.record < b.record);
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    for (uint bare = flat_workgroup(); bare < tally.bare; bare += gl_NumWorkGroups.x * gl_NumWorkGroups.y * gl_NumWorkGroups.z) {
        uint index = bare_pixels[bare];
        PixelSurface pixel = pixel_surface_at(Pixels, index);
        SplatWeight mine = SplatWeight(0xffffffffu, -1e30);
        for (uint record = thread; record < push.record_count; record += gl_WorkGroupSize.x) {
            // The further and the more turned, the worse.
            CachePoint point = cache_point_at(CachePoints, record);
            float weight = -distance(pixel.position, point.position) * (20.0 - 19.0 * dot(pixel.normal, point.normal));
            SplatWeight candidate = SplatWeight(record, weight);
            if (is_better(candidate, mine)) mine = candidate;
        }
        best[thread] = mine;
        for (uint stride = gl_WorkGroupSize.x / 2u; stride > 0u; stride /= 2u) {
            barrier();
            if (thread < stride && is_better(best[thread + stride], best[thread])) best[thread] = best[thread + stride];
        }
        uint place = weight_runs[index].first;
        if (thread == 0u && place < push.weight_capacity) weights[place] = SplatWeight(best[0].record, -1.0);
        barrier();
    }
}
