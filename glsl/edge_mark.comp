// Antialiasing, step 1: marks the pixels that may show two surfaces. The first dispatch marks
// pixels that differ from one beside them, or that show holes of a triangle and surface. The
// second marks pixels that an edge of the mesh crosses: what is narrower than a pixel may be
// between all middles. Deterministic. One invocation = one pixel, in tile order, or one edge. In:
// camera, surfaces at the pixels, edges. Out: in tile order, 1 for such an edge pixel, else 0.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/records.glsl"
#include "include/quirks.glsl"
#include "include/lines.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint CREASE = 0;    // float bits: cosine below which neighbouring normals make an edge
layout(constant_id = 1) const uint STEP = 0;      // float bits: distance from the neighbour's plane that makes one, pixel widths

struct EdgeMarkPush {
    View view;
    uint edge_count;  // of the mesh; 0: the invocations are pixels
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer MeshEdges { MeshEdge mesh_edges[]; };
layout(binding = 4) uniform usamplerBuffer Pixels;
layout(scalar, binding = 5) buffer EdgeMarks { uint edge_marks[]; };
layout(scalar, binding = 6) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { EdgeMarkPush push; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/projected.glsl"

// How far behind the plane of a pixel's surface an edge may be that is on that surface, in pixel
// widths: more than rounding takes.
const float BEHIND = 0.1;

bool is_edge(PixelSurface a, PixelSurface b) {
    if (a.side == NO_SIDE || b.side == NO_SIDE) return a.side != b.side;
    if (surface_at(a.side >> 1).material != surface_at(b.side >> 1).material) return true;
    if (dot(a.normal, b.normal) < uintBitsToFloat(CREASE)) return true;
    // Smooth shading hides a sharp edge from direct light. Indirect light depends on the facet's
    // horizon and still shows it.
    if (dot(facet_of(surface_at(a.side >> 1), a.side), facet_of(surface_at(b.side >> 1), b.side)) < FACETS_ALIKE) return true;
    vec3 apart = b.position - a.position;
    float off_plane = min(abs(dot(apart, a.normal)), abs(dot(apart, b.normal)));
    return off_plane > uintBitsToFloat(STEP) * sqrt(max(a.footprint, b.footprint));
}

// Maximum number of points of a pixel at which holes are looked for, along each side.
const uint MAX_POINTS = 8u;
// Triangles with holes, one behind the other, that are looked at in a pixel.
const uint MAX_LAYERS = 16u;
// Distance from one to the next, over that from the camera: more than rounding takes.
const float APART = 1e-4;

// Weights of a triangle's corners at an offset from the centre.
vec3 weights_at(Projected triangle, vec2 offset) {
    vec3 edges = edges_at(triangle, offset);
    return edges / (edges.x + edges.y + edges.z);
}

// Whether a pixel may show holes and surface: of a triangle, or of those beside it. The points are
// as close as its micro-triangles, or as their number allows.
bool is_partly_hole(uvec2 pixel, uint triangle) {
    Projected seen = projected(push.view, centre_of(push.view, pixel), corners_of(triangle));
    vec2 size = pixel_size(push.view);
    vec3 at_centre = weights_at(seen, vec2(0.0));
    vec3 across = abs(weights_at(seen, vec2(0.5 * size.x, 0.0)) - at_centre);
    vec3 down = abs(weights_at(seen, vec2(0.0, 0.5 * size.y)) - at_centre);
    float parts = 2.0 * largest_of(across + down) * float(1u << micromap_level(triangle));
    uint points = uint(clamp(ceil(parts) + 1.0, 2.0, float(MAX_POINTS)));
    bool first = false;
    bool found = false;
    for (uint i = 0u; i < points * points && !found; ++i) {
        vec2 place = (vec2(i % points, i / points) + 0.5) / float(points) - 0.5;
        vec3 weights = weights_at(seen, place * size);
        bool hole = is_hole(triangle, weights);
        if (i == 0u) first = hole;
        // Outside is what a triangle beside it shows. NaN is outside.
        found = hole != first || !(min(weights.x, min(weights.y, weights.z)) >= 0.0);
    }
    return found;
}

// Whether a pixel may show holes and surface at a triangle that the ray through its middle meets,
// up to what it shows there.
bool shows_holes(uvec2 pixel, PixelSurface shown) {
    vec3 direction = direction_through(push.view, vec2(pixel) + 0.5);
    float end = shown.side == NO_SIDE ? 1e30 : (1.0 + APART) * sqrt(shown.footprint / push.view.pixel_area);
    float begin = 0.0;
    bool found = false;
    for (uint layer = 0u; layer < MAX_LAYERS && !found && begin < end; ++layer) {
        Hit hit;
        if (!trace_with_holes(Ray(push.view.position + begin * direction, direction, end - begin), hit)) break;
        if (!has_holes(hit.triangle)) break;
        found = is_partly_hole(pixel, hit.triangle);
        begin = (1.0 + APART) * (begin + hit.t);
    }
    return found;
}

// Marks a pixel that differs from one beside it, or that shows holes and surface.
void mark_pixel(uint place) {
    ivec2 size = ivec2(push.view.width, push.view.height);
    ivec2 xy = ivec2(pixel_in_tiles(place, push.view.width));
    bool is_inside = all(lessThan(xy, size));
    PixelSurface pixel = pixel_surface_at(Pixels, is_inside ? xy.y * size.x + xy.x : 0);
    bool found = false;
    for (int i = 1; i < 9 && is_inside && !found; i += 2) {
        // Above, left, right, below.
        ivec2 other = clamp(xy + ivec2(i % 3, i / 3) - 1, ivec2(0), size - 1);
        found = is_edge(pixel, pixel_surface_at(Pixels, other.y * size.x + other.x));
    }
    if_any (HAS_CUTOUTS != 0u && is_inside && !found) found = shows_holes(uvec2(xy), pixel);
    edge_marks[place] = uint(found);
}

vec3 corner_of(Corners triangle, uint number) { return number == 0u ? triangle.p0 : number == 1u ? triangle.p1 : triangle.p2; }

// Whether a line from one point to another is an outline, between triangles with these third
// corners: both are on one side of it.
bool is_outline(vec3 from, vec3 to, vec3 first, vec3 second) {
    vec3 along = to - from;
    vec3 to_edge = from - push.view.position;
    return (dot(cross(along, first - from), to_edge) > 0.0) == (dot(cross(along, second - from), to_edge) > 0.0);
}

// Whether an edge is not behind what the middle of a pixel shows. `point` is of the edge: its place
// in the image, and 1 / depth.
bool is_seen(uvec2 pixel, vec3 point) {
    PixelSurface shown = pixel_surface_at(Pixels, pixel.y * push.view.width + pixel.x);
    if (shown.side == NO_SIDE) return true;
    vec3 position = push.view.position + direction_through(push.view, point.xy) / point.z;
    return dot(position - shown.position, facing_normal(shown.side)) > -BEHIND * sqrt(shown.footprint);
}

// Marks a pixel that an edge crosses, if it is seen there.
void mark_crossed(uvec2 pixel, vec3 point) {
    uint place = place_in_tiles(pixel, push.view.width);
    // Most are marked already.
    bool is_open = edge_marks[place] == 0u;
    if_any (is_open) {
        if (is_seen(pixel, point)) edge_marks[place] = 1u;
    }
}

// Marks the pixels that a line crosses, column by column along its longer axis. Its ends are places
// in the image, and 1 / depth, which is linear there.
void mark_line(vec3 from, vec3 to) {
    ivec2 last_pixel = ivec2(push.view.width, push.view.height) - 1;
    bool is_steep = abs(to.y - from.y) > abs(to.x - from.x);
    if (is_steep) {
        from = from.yxz;
        to = to.yxz;
        last_pixel = last_pixel.yx;
    }
    vec3 first = from.x > to.x ? to : from;
    vec3 last = from.x > to.x ? from : to;
    float inverse = 1.0 / max(last.x - first.x, 1e-5);
    int begin = clamp(int(floor(first.x)), 0, last_pixel.x);
    int end = clamp(int(floor(last.x)), 0, last_pixel.x);
    for (int column = begin; column <= end; ++column) {
        vec2 span = clamp((vec2(column, column + 1) - first.x) * inverse, 0.0, 1.0);
        vec3 enters = mix(first, last, span.x);
        vec3 leaves = mix(first, last, span.y);
        vec3 middle = 0.5 * (enters + leaves);
        int low = clamp(int(floor(min(enters.y, leaves.y))), 0, last_pixel.y);
        int high = clamp(int(floor(max(enters.y, leaves.y))), 0, last_pixel.y);
        mark_crossed(is_steep ? uvec2(low, column) : uvec2(column, low), is_steep ? middle.yxz : middle);
        bool has_two = high != low;
        if_any (has_two) mark_crossed(is_steep ? uvec2(high, column) : uvec2(column, high), is_steep ? middle.yxz : middle);
    }
}

// A point in pixels from the corner of the image, and 1 / depth.
vec3 in_image(vec3 seen) {
    return vec3((0.5 + 0.5 * seen.xy / seen.z) * vec2(push.view.width, push.view.height), 1.0 / seen.z);
}

void mark_edge(MeshEdge edge) {
    Corners own = corners_of(edge.own >> 2);
    uint opposite = edge.own & 3u;
    vec3 from = corner_of(own, opposite == 2u ? 0u : opposite + 1u);
    vec3 to = corner_of(own, opposite == 0u ? 2u : opposite - 1u);
    bool is_drawn = edge.other == EVERY_VIEW;
    if (!is_drawn) is_drawn = is_outline(from, to, corner_of(own, opposite), corner_of(corners_of(edge.other >> 2), edge.other & 3u));
    vec3 a = from_centre(push.view, vec2(0.0), from);
    vec3 b = from_centre(push.view, vec2(0.0), to);
    // The part in front of the camera and in the image.
    vec2 span = vec2(0.0, is_drawn ? 1.0 : -1.0);
    float least = 1e-6 * (abs(a.z) + abs(b.z)) + 1e-20;
    clip(a.z - least, b.z - least, span);
    clip(a.z - a.x, b.z - b.x, span);
    clip(a.z + a.x, b.z + b.x, span);
    clip(a.z - a.y, b.z - b.y, span);
    clip(a.z + a.y, b.z + b.y, span);
    if_any (span.x <= span.y) mark_line(in_image(mix(a, b, span.x)), in_image(mix(a, b, span.y)));
}

void main() {
    uint index = flat_invocation();
    uint places = 64u * tiles_around(uvec2(push.view.width, push.view.height));
    if_any (push.edge_count == 0u && index < places) mark_pixel(index);
    if_any (index < push.edge_count) mark_edge(mesh_edges[index]);
    if (!loops_completed(push.view.width)) truncated_loops[0] = LOOP_TRUNCATED;
}
