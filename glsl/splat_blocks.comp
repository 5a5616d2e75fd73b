// Splatting, step 1: boxes around blocks of consecutive records, and the counts of the view set to
// zero. Deterministic. One invocation = one block. In: cache points. Out: boxes, metres; counts.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/splat.glsl"

layout(local_size_x = 64) in;

struct SplatBlocksPush { uint record_count; };

layout(binding = 0) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 1) writeonly buffer BlockBoxes { RecordBox block_boxes[]; };
layout(scalar, binding = 2) writeonly buffer Tally { SplatTally tally; };
layout(scalar, binding = 3) writeonly buffer UncoveredPixels { uint uncovered_pixels[]; };  // see splat_weights
layout(scalar, binding = 4) writeonly buffer UncoveredPoints { uint uncovered_points[]; };
layout(scalar, push_constant) uniform Push { SplatBlocksPush push; };

void main() {
    if (flat_invocation() == 0u) {
        tally = SplatTally(0u, 0u, 0u);
        for (uint i = 0u; i < 4u; ++i) uncovered_pixels[i] = uncovered_points[i] = 0u;
    }
    uint first = flat_invocation() * RECORD_BLOCK;
    if (first >= push.record_count) return;
    RecordBox box = RecordBox(vec3(1e30), vec3(-1e30));
    for (uint i = first; i < min(first + RECORD_BLOCK, push.record_count); ++i) {
        vec3 position = cache_point_at(CachePoints, i).position;
        box = RecordBox(min(box.low, position), max(box.high, position));
    }
    block_boxes[flat_invocation()] = box;
}
