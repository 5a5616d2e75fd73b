// Splatting, step 3: gives each uncovered pixel the best-fitting record of all. The search skips
// blocks of records that are further away than the best misfit so far. Deterministic: of equal
// records the first wins. One workgroup = one pixel. In: uncovered pixels, records, boxes around
// blocks of records. Out: the pixel's only weight.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/splat.glsl"

layout(local_size_x_id = 3) in;

struct SplatNearestPush {
    uint record_count;
    uint weight_capacity;
};

layout(binding = 0) uniform usamplerBuffer Pixels;
layout(binding = 1) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 2) readonly buffer BlockBoxes { RecordBox block_boxes[]; };
layout(scalar, binding = 3) readonly buffer WeightRanges { WeightRange weight_ranges[]; };
layout(scalar, binding = 4) readonly buffer UncoveredPixels { uint uncovered_pixels[]; };  // see splat_tiles
layout(scalar, binding = 5) writeonly buffer Weights { SplatWeight weights[]; };
layout(scalar, push_constant) uniform Push { SplatNearestPush push; };

const uint NONE = 0xffffffffu;
shared uint least;  // float bits; non-negative floats compare alike as integers
shared uint first;  // lowest index with that value

// Minimum over the workgroup: afterwards `least` and `first` hold the smallest value and the lowest
// index that has it.
void find_least(float value, uint index) {
    barrier();
    if (gl_LocalInvocationIndex == 0u) least = first = NONE;
    barrier();
    atomicMin(least, floatBitsToUint(value));
    barrier();
    if (floatBitsToUint(value) == least) atomicMin(first, index);
    barrier();
}

// Misfit of a record: grows with the distance and the angle, and is at least the distance.
float misfit(PixelSurface pixel, uint record) {
    CachePoint point = cache_point_at(CachePoints, record);
    return distance(pixel.position, point.position) * (20.0 - 19.0 * dot(pixel.normal, point.normal));
}

// A lower bound of the distance, despite rounding.
float min_distance(vec3 position, RecordBox box) {
    return 0.9999 * length(max(max(box.low - position, position - box.high), vec3(0.0)));
}

uint end_of_block(uint block) { return min((block + 1u) * RECORD_BLOCK, push.record_count); }

void main() {
    uint thread = gl_LocalInvocationIndex;
    if (flat_workgroup() >= uncovered_pixels[3]) return;
    uint index = uncovered_pixels[4u + flat_workgroup()];
    PixelSurface pixel = pixel_surface_at(Pixels, index);
    uint block_count = (push.record_count + RECORD_BLOCK - 1u) / RECORD_BLOCK;
    // The nearest block gives an upper bound of the misfit.
    float best = 1e30;
    uint chosen = NONE;
    for (uint block = thread; block < block_count; block += gl_WorkGroupSize.x) {
        float away = min_distance(pixel.position, block_boxes[block]);
        chosen = away < best ? block : chosen;
        best = min(away, best);
    }
    find_least(best, chosen);
    best = 1e30;
    for (uint i = first * RECORD_BLOCK + thread; i < end_of_block(first); i += gl_WorkGroupSize.x) best = min(misfit(pixel, i), best);
    find_least(best, chosen);
    // Records of all blocks within that bound.
    float bound = uintBitsToFloat(least);
    best = 1e30;
    for (uint block = thread; block < block_count; block += gl_WorkGroupSize.x) {
        if (min_distance(pixel.position, block_boxes[block]) > bound) continue;
        for (uint i = block * RECORD_BLOCK; i < end_of_block(block); ++i) {
            float found = misfit(pixel, i);
            chosen = found < best ? i : chosen;
            best = min(found, best);
        }
    }
    find_least(best, chosen);
    uint place = weight_ranges[index].first;
    if (thread == 0u && place < push.weight_capacity) weights[place] = SplatWeight(first, -1.0);
}
