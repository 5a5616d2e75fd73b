// Antialiasing of a light, step 3: lists the pixels at which its light changes much, such as shadow
// edges, and those in its penumbra. Edge pixels show their fragments instead; they are listed if
// they have the mark of a penumbra, which has to be removed. Sizes a dispatch of four pixels a
// workgroup. The list is unordered, because each pixel is averaged by itself. One invocation = four
// consecutive pixels, a texel of each list. In: the per-light irradiance buffer, edge pixels. Out:
// pixels, their number, dispatch size; initially zero.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct ShadowMarkPush {
    uint width;
    uint height;
    float contrast;  // relative difference between neighbours that makes an edge
};

layout(binding = 0) uniform usamplerBuffer LightIrradiance;
layout(binding = 1) uniform usamplerBuffer EdgeNumbers;
layout(scalar, binding = 2) writeonly buffer ShadowPixels { uint shadow_pixels[]; };
layout(scalar, binding = 3) buffer ShadowGroups { uint shadow_groups[]; };
layout(scalar, push_constant) uniform Push { ShadowMarkPush push; };

// The light at pixel `first` and the next three, negative in the penumbra. Values beyond
// `pixel_count` are arbitrary; the caller masks them.
vec4 light_from(int first, int pixel_count) {
    ivec2 texels = clamp((ivec2(first) >> 2) + ivec2(0, 1), 0, (pixel_count - 1) >> 2);
    vec4 a = uintBitsToFloat(texelFetch(LightIrradiance, texels.x));
    vec4 b = uintBitsToFloat(texelFetch(LightIrradiance, texels.y));
    int skipped = first & 3;
    vec4 half_way = skipped >= 2 ? vec4(a.zw, b.xy) : a;
    return (skipped & 1) == 0 ? half_way : vec4(half_way.yzw, skipped == 1 ? b.x : b.z);
}

bvec4 both(bvec4 a, bvec4 b) { return bvec4(uvec4(a) & uvec4(b)); }
bvec4 either(bvec4 a, bvec4 b) { return bvec4(uvec4(a) | uvec4(b)); }

bvec4 differ(vec4 here, vec4 there) {
    vec4 most = max(here, there);
    return both(greaterThanEqual(abs(here - there), push.contrast * most), greaterThan(most, vec4(0.0)));
}

void main() {
    int width = int(push.width);
    int pixel_count = width * int(push.height);
    int first = 4 * int(flat_invocation());
    if (first >= pixel_count) return;
    ivec2 place = ivec2(in_rows(uint(first), push.width));
    ivec4 column = ivec4(place.x);
    ivec4 row = ivec4(place.y);
    for (int i = 1; i < 4; ++i) {
        bool begins = column[i - 1] + 1 == width;
        column[i] = begins ? 0 : column[i - 1] + 1;
        row[i] = row[i - 1] + int(begins);
    }

    vec4 marked = light_from(first, pixel_count);
    vec4 here = abs(marked);
    bvec4 found = both(differ(here, abs(light_from(first - 1, pixel_count))), greaterThan(column, ivec4(0)));
    found = either(found, both(differ(here, abs(light_from(first + 1, pixel_count))), lessThan(column, ivec4(width - 1))));
    found = either(found, both(differ(here, abs(light_from(first - width, pixel_count))), greaterThan(row, ivec4(0))));
    found = either(found, both(differ(here, abs(light_from(first + width, pixel_count))), lessThan(row, ivec4(int(push.height) - 1))));
    // The mark is the sign, of zero, too.
    bvec4 has_mark = notEqual(floatBitsToUint(marked) & 0x80000000u, uvec4(0u));

    uvec4 edges = texelFetch(EdgeNumbers, first >> 2);
    for (int i = 0; i < 4; ++i) {
        if (first + i >= pixel_count) break;
        if (!(has_mark[i] || (found[i] && edges[i] == NO_EDGE))) continue;
        uint place = atomicAdd(shadow_groups[3], 1u);
        shadow_pixels[place] = uint(first + i);
        // The first pixel of a group counts the group.
        if (place % 4u != 0u) continue;
        for (uint axis = 0u; axis < 3u; ++axis) atomicMax(shadow_groups[axis], swizzled(place / 4u + 1u)[axis]);
    }
}
