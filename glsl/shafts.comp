// Shafts: the possible occluders between a light and batches of points. [Haines] Deterministic,
// except for the order of the list. One invocation = one batch. In: batches, the light, the tree.
// Out: for each batch the nodes and triangles from which its shadow rays start; an unordered list
// of the batches with nodes; dispatch sizes of one workgroup each.
//
// A shaft is the convex hull of two boxes, that of the rays' origins and that of the light. It is
// bounded by the box around both and by planes through two edges, one of each box, parallel to
// the same axis.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/indirect.glsl"

layout(local_size_x = 64) in;

struct ShaftsPush {
    uint light;
    uint traces_all;  // 1: rays start from the tree's root
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Lights;

#include "include/triangles.glsl"
#include "include/bvh.glsl"
#include "include/shafts.glsl"

layout(scalar, binding = 3) readonly buffer PointBatches { PointBatch point_batches[]; };
layout(scalar, binding = 4) writeonly buffer ShaftRoots { uint roots[]; };
layout(scalar, binding = 5) buffer ShaftList { uint shaft_list[]; };
layout(scalar, push_constant) uniform Push { ShaftsPush push; };

struct Box {
    vec3 low;
    vec3 high;
};

struct Shaft {
    Box points;
    Box light;
    Box around;        // both boxes and a clear distance more, which exceeds rounding
    vec3 planes[12];   // four for each pair of axes k, k + 1: normal along these, offset; all zero where there is none
    float offset;      // of the points from their surfaces
};

// The box of a light. For a directional light it is the box of the points, moved out of the scene.
Box light_box(LightSource light, Box points, float far) {
    if (light.kind == LIGHT_DIRECTIONAL) return Box(points.low - far * light.axis, points.high - far * light.axis);
    vec3 low = light.position + min(light.edge_u, vec3(0.0)) + min(light.edge_v, vec3(0.0));
    vec3 high = light.position + max(light.edge_u, vec3(0.0)) + max(light.edge_v, vec3(0.0));
    return Box(low, high);
}

Shaft shaft;  // of this invocation's batch

Shaft shaft_between(Box points, Box light, float clear, float offset) {
    Shaft made;
    made.points = points;
    made.light = light;
    made.around = Box(min(points.low, light.low) - clear, max(points.high, light.high) + clear);
    made.offset = offset;
    for (uint k = 0u; k < 3u; ++k) {
        uint l = (k + 1u) % 3u;
        for (uint quadrant = 0u; quadrant < 4u; ++quadrant) {
            // The corners of both boxes that lie furthest towards the quadrant, seen along the
            // third axis.
            bvec2 is_high = bvec2((quadrant & 1u) != 0u, (quadrant & 2u) != 0u);
            vec2 sign = mix(vec2(-1.0), vec2(1.0), is_high);
            vec2 near = mix(vec2(points.low[k], points.low[l]), vec2(points.high[k], points.high[l]), is_high) + clear * sign;
            vec2 far = mix(vec2(light.low[k], light.low[l]), vec2(light.high[k], light.high[l]), is_high) + clear * sign;
            vec2 along = (far - near) * sign;
            // The line through both bounds the hull if its normal points into the quadrant.
            vec2 normal = along.x * along.y < 0.0 ? abs(along.yx) * sign : vec2(0.0);
            made.planes[4u * k + quadrant] = vec3(normal, dot(normal, near));
        }
    }
    return made;
}

bool is_outside(vec3 low, vec3 high) {
    if (any(greaterThan(low, shaft.around.high)) || any(lessThan(high, shaft.around.low))) return true;
    bool found = false;
    for (uint k = 0u; k < 3u; ++k) {
        uint l = (k + 1u) % 3u;
        for (uint quadrant = 0u; quadrant < 4u; ++quadrant) {
            vec3 plane = shaft.planes[4u * k + quadrant];
            vec2 least = vec2((quadrant & 1u) != 0u ? low[k] : high[k], (quadrant & 2u) != 0u ? low[l] : high[l]);
            found = found || dot(plane.xy, least) > plane.z;
        }
    }
    return found;
}

// Minimum and maximum of across·(x - origin) in a box, widened by the rounding error: `blur` a
// metre, and `slack`.
vec2 extent(Box box, vec3 across, vec3 origin, float blur, float slack) {
    vec3 middle = 0.5 * (box.low + box.high) - origin;
    vec3 reach = 0.5 * (box.high - box.low);
    float most = dot(abs(across), reach) + blur * (length(middle) + length(reach)) + slack;
    return dot(across, middle) + vec2(-most, most);
}

// False if no ray from the points to the light can meet a triangle.
bool is_inside(Corners corners) {
    vec3 p0 = corners.p0;
    vec3 p1 = corners.p1;
    vec3 p2 = corners.p2;
    vec3 low = min(p0, min(p1, p2));
    vec3 high = max(p0, max(p1, p2));
    if (any(greaterThan(low, shaft.around.high)) || any(lessThan(high, shaft.around.low))) return false;
    for (uint i = 0u; i < 12u; ++i) {
        uint k = i / 4u;
        uint l = (k + 1u) % 3u;
        vec3 plane = shaft.planes[i];
        float least = min(dot(plane.xy, vec2(p0[k], p0[l])), min(dot(plane.xy, vec2(p1[k], p1[l])), dot(plane.xy, vec2(p2[k], p2[l]))));
        if (least > plane.z) return false;
    }
    // No ray crosses the triangle's plane if all points and all of the light are on one side.
    // Origins are clear of their own surface.
    vec3 across = cross(p1 - p0, p2 - p0);
    float blur = 5e-7 * length(p1 - p0) * length(p2 - p0);
    float slack = 0.25 * shaft.offset * length(across);
    vec2 here = extent(shaft.points, across, p0, blur, slack);
    vec2 there = extent(shaft.light, across, p0, blur, slack);
    return min(here.x, there.x) <= 0.0 && max(here.y, there.y) >= 0.0;
}

const uint MAX_OPENED = 48u;

#include "include/open_tree.glsl"

// Whether some point may face the light.
bool may_face(PointBatch batch, Box light, float clear) {
    vec3 between = 0.5 * (light.low + light.high - batch.low - batch.high);
    vec3 reach = 0.5 * (light.high - light.low + batch.high - batch.low);
    float most = dot(batch.normal, between) + dot(abs(batch.normal), reach);
    return most + (batch.spread + 1e-5) * length(abs(between) + reach) + 2.0 * clear > 0.0;
}

void main() {
    uint index = flat_invocation();
    if (index >= point_batches.length()) return;
    uint first = index * SHAFT_WORDS;
    PointBatch batch = point_batches[index];
    Node root = node_at(0u);
    Box points = Box(batch.low, batch.high);
    float clear = scene_clear_distance();
    Box light = light_box(light_at(Lights, push.light), points, 1024.0 * dot(node_cell(root), vec3(1.0)));
    uint counts = 0u;
    shaft = shaft_between(points, light, clear, least_clear_distance(batch.low, batch.high));
    if (push.traces_all != 0u) {
        roots[first + MAX_ROOTS] = 0u;
        counts = 1u << 16;
    } else if (!is_empty(batch) && may_face(batch, light, clear)) {
        counts = open_tree(first);
    }
    roots[first] = counts;
    if (counts >> 16 == 0u) return;
    uint place = atomicAdd(shaft_list[3], 1u);
    shaft_list[4u + place] = index;
    for (uint axis = 0u; axis < 3u; ++axis) atomicMax(shaft_list[axis], swizzled(place + 1u)[axis]);
}
