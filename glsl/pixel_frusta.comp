// Frusta of pixels: the few triangles and nodes that camera rays through a pixel may meet, from
// which they start instead of the root. Deterministic. One invocation = one pixel at which a light
// is averaged. In: pixels whose samples take a camera ray, the tree. Out: their roots, in the
// format of shafts; none for pixels beyond the capacity.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/antialias.glsl"

layout(local_size_x = 64) in;

struct EdgeSamplesPush {
    View view;
    EdgeCapacity capacity;
    float smooth_m2;  // see edge_samples
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Surfaces;
layout(scalar, binding = 3) readonly buffer EdgeNumbers { uint edge_numbers[]; };
layout(binding = 4) uniform usamplerBuffer Pixels;
layout(scalar, binding = 5) readonly buffer ShadowGroups { uint shadow_groups[]; };
layout(scalar, binding = 6) readonly buffer ShadowPixels { uint shadow_pixels[]; };

#include "include/triangles.glsl"
#include "include/surfaces.glsl"
#include "include/bvh.glsl"
#include "include/view.glsl"
#include "include/primary.glsl"
#include "include/shafts.glsl"

layout(scalar, binding = 7) writeonly buffer ShaftRoots { uint shaft_roots[]; };
layout(scalar, push_constant) uniform Push { EdgeSamplesPush push; };

// Margin of a frustum around its pixel, in pixels: more than rounding takes.
const float MARGIN = 1.0 / 64.0;

struct Frustum {
    vec3 apex;
    vec3 corners[4];  // unit directions
    vec3 planes[4];   // unit normals to the outside
    float clear;      // rounding error of a distance from a plane
};

Frustum frustum;  // of this invocation's pixel

Frustum frustum_of(View view, vec2 corner) {
    Frustum made;
    made.apex = view.position;
    made.clear = scene_clear_distance();
    for (uint i = 0u; i < 4u; ++i) {
        vec2 side = vec2(i == 1u || i == 2u, i >= 2u);
        made.corners[i] = normalize(direction_through(view, corner + mix(vec2(-MARGIN), vec2(1.0 + MARGIN), side)));
    }
    for (uint i = 0u; i < 4u; ++i) {
        vec3 normal = normalize(cross(made.corners[i], made.corners[(i + 1u) % 4u]));
        made.planes[i] = dot(normal, made.corners[(i + 2u) % 4u]) > 0.0 ? -normal : normal;
    }
    return made;
}

bool is_outside(vec3 low, vec3 high) {
    bool found = false;
    for (uint i = 0u; i < 4u; ++i) {
        vec3 nearest = mix(high, low, greaterThan(frustum.planes[i], vec3(0.0)));
        found = found || dot(frustum.planes[i], nearest - frustum.apex) > frustum.clear;
    }
    return found;
}

// Whether all of the frustum lies beyond the plane through its apex and an edge, as seen from the
// third corner.
bool is_beyond(vec3 a, vec3 b, vec3 third) {
    vec3 across = cross(a, b);
    float inside = dot(across, third) < 0.0 ? -1.0 : 1.0;
    float most = -1e30;
    for (uint i = 0u; i < 4u; ++i) most = max(most, inside * dot(across, frustum.corners[i]));
    return most < -frustum.clear * (length(a) + length(b)) - 1e-6 * length(a) * length(b);
}

// False if no ray of the frustum can meet a triangle.
bool is_inside(Corners triangle) {
    vec3 a = triangle.p0 - frustum.apex;
    vec3 b = triangle.p1 - frustum.apex;
    vec3 c = triangle.p2 - frustum.apex;
    for (uint i = 0u; i < 4u; ++i) {
        vec3 plane = frustum.planes[i];
        if (min(dot(plane, a), min(dot(plane, b), dot(plane, c))) > frustum.clear) return false;
    }
    return !(is_beyond(a, b, c) || is_beyond(b, c, a) || is_beyond(c, a, b));
}

#include "include/open_tree.glsl"

// Pixels that need roots, compacted: on a CPU eight invocations execute the work of any
// one of them.
shared uint due[64];
shared uint due_count;

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint own = flat_invocation();
    bool is_due = own < min(shadow_groups[3], frusta_in(push.capacity));
    if (lane == 0u) due_count = 0u;
    barrier();
    if (is_due) {
        uint index = shadow_pixels[own];
        vec2 corner = vec2(in_rows(index, push.view.width));
        bool is_traced = edge_numbers[index] != NO_EDGE || is_sampled_by_rays(push.view, corner, pixel_surface_at(Pixels, index));
        if (is_traced) due[atomicAdd(due_count, 1u)] = own;
        else shaft_roots[own * SHAFT_WORDS] = 0u;
    }
    barrier();
    if (lane >= due_count) return;
    uint place = due[lane];
    uint pixel = shadow_pixels[place];
    frustum = frustum_of(push.view, vec2(in_rows(pixel, push.view.width)));
    uint first = place * SHAFT_WORDS;
    shaft_roots[first] = open_tree(first);
}
