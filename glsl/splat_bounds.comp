// Splatting, step 1: the pixels that a record's sphere of validity can touch, and their 16×16
// tiles. [Yue §4] Deterministic. One invocation = one record. In: cache points, camera. Out: pixel
// rectangle and the number of its tiles.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/dispatch.glsl"
#include "include/splat.glsl"

layout(local_size_x = 64) in;

struct SplatBoundsPush {
    View view;
    uint record_count;
};

layout(binding = 0) uniform usamplerBuffer CachePoints;
layout(scalar, binding = 1) writeonly buffer Rectangles { PixelRectangle rectangles[]; };
layout(scalar, binding = 2) writeonly buffer TileCounts { uint tile_counts[]; };
layout(scalar, binding = 3) writeonly buffer Tally { SplatTally tally; };
layout(scalar, binding = 4) readonly buffer TileBoxes { TileBox tile_boxes[]; };
layout(scalar, binding = 5) writeonly buffer UncoveredPixels { uint uncovered_pixels[]; };  // see splat_tiles
layout(scalar, binding = 6) writeonly buffer CrowdedTiles { uint crowded_tiles[]; };
layout(scalar, push_constant) uniform Push { SplatBoundsPush push; };

// Range of x/z over a circle of radius r around (x, z): the slopes of its two tangents through the
// origin.
vec2 tangent_slopes(float x, float z, float r) {
    if (z <= r * 1.001) return vec2(-1e30, 1e30);
    float root = r * sqrt(x * x + z * z - r * r);
    return (x * z + vec2(-root, root)) / (z * z - r * r);
}

void main() {
    uint index = flat_invocation();
    if (index == 0u) {
        tally = SplatTally(0u, 0u, 0u);
        for (uint i = 0u; i < 4u; ++i) uncovered_pixels[i] = crowded_tiles[i] = 0u;
    }
    if (index >= push.record_count) return;
    View view = push.view;
    CachePoint point = cache_point_at(CachePoints, index);
    vec3 d = point.position - view.position;
    float half_width = length(view.right);
    float half_height = length(view.up);
    float depth = dot(d, view.forward);

    // sin 20.5°: the 10° of `VALID` in records.glsl, and as much for shading normals that
    // lean beyond the silhouette. A record whose plane, tilted so, still faces away serves
    // no pixel validly.
    bool faces_away = dot(d, point.normal) > 0.35 * length(d) + point.radius;
    vec2 x = tangent_slopes(dot(d, view.right) / half_width, depth, point.radius) / half_width;
    vec2 y = tangent_slopes(-dot(d, view.up) / half_height, depth, point.radius) / half_height;
    vec2 size = vec2(view.width, view.height);
    vec2 low = clamp((vec2(x.x, y.x) * 0.5 + 0.5) * size - 1.0, vec2(0.0), size);
    vec2 high = clamp((vec2(x.y, y.y) * 0.5 + 0.5) * size + 1.0, vec2(0.0), size);
    bool visible = !faces_away && depth > -point.radius && all(lessThan(low, high));

    uvec2 first = visible ? uvec2(low) : uvec2(0u);
    uvec2 end = visible ? uvec2(ceil(high)) : uvec2(0u);
    PixelRectangle rectangle = PixelRectangle(first.x | (first.y << 16), end.x | (end.y << 16));
    rectangles[index] = rectangle;
    uvec4 tiles = tiles_of(rectangle);
    uint columns = (view.width + 15u) / 16u;
    uint count = 0u;
    for (uint y = tiles.y; y < tiles.w; ++y) {
        for (uint x = tiles.x; x < tiles.z; ++x) {
            count += uint(reaches(point.position, point.radius, tile_boxes[y * columns + x]));
        }
    }
    tile_counts[index] = count;
}
