// Draws the edges at which shadows of a light may end into its maps: into every texel that they
// touch, as near to the light as they are there. An edge is a silhouette if both of its triangles
// are on one side of it, as the light sees them. Deterministic. One invocation = one edge and one
// point sample of the light. In: edges, the light. Out: its maps, initially zero.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/texels.glsl"
#include "include/lists.glsl"
#include "include/dispatch.glsl"
#include "include/quirks.glsl"
#include "include/math.glsl"
#include "include/lines.glsl"

layout(local_size_x = 64) in;

struct SilhouettesPush {
    uint edge_count;
    uint sample_count;
    uint light;  // row
};

layout(binding = 0) uniform usamplerBuffer Nodes;
layout(binding = 1) uniform usamplerBuffer Triangles;
layout(binding = 2) uniform usamplerBuffer Lights;
layout(scalar, binding = 3) readonly buffer SilhouetteEdges { SilhouetteEdge silhouette_edges[]; };
layout(scalar, binding = 4) buffer Silhouettes { uint silhouettes[]; };
layout(scalar, binding = 5) writeonly buffer TruncatedLoops { uint truncated_loops[]; };  // host-visible flag: LOOP_TRUNCATED after a truncated loop
layout(scalar, push_constant) uniform Push { SilhouettesPush push; };

#include "include/triangles.glsl"
#include "include/bvh.glsl"
#include "include/lights.glsl"
#include "include/light_kind.glsl"
#include "include/silhouettes.glsl"

// Sine of the angle between a triangle and the direction to the light below which rounding decides
// on which side of the triangle the light is.
const float GRAZING = 1e-5;

// On which side the triangle of an edge is, as seen from the light: its sign; zero if that is
// uncertain.
float side_of(vec3 edge, vec3 to_corner, vec3 to_edge) {
    vec3 across = cross(edge, to_corner);
    float side = dot(across, to_edge);
    return abs(side) <= GRAZING * length(across) * length(to_edge) ? 0.0 : side;
}

bool is_silhouette(SilhouetteEdge edge, LightSource light) {
    vec3 along = edge.to - edge.from;
    vec3 to_edge = is_parallel() ? light.axis : edge.from - light.position;
    float first = side_of(along, edge.first - edge.from, to_edge);
    float second = side_of(along, edge.second - edge.from, to_edge);
    return first == 0.0 || second == 0.0 || (first > 0.0) == (second > 0.0);
}

// Draws a line on a face, column by column along its longer axis.
void draw(uint sample_index, uint face, vec3 from, vec3 to) {
    bool is_steep = abs(to.y - from.y) > abs(to.x - from.x);
    if (is_steep) {
        from = from.yxz;
        to = to.yxz;
    }
    vec3 first = from.x > to.x ? to : from;
    vec3 last = from.x > to.x ? from : to;
    int side = int(map_side());
    float length = last.x - first.x;
    float inverse = length > 1e-5 ? 1.0 / length : 0.0;
    int begin = clamp(int(floor(first.x - MAP_SLACK)), 0, side - 1);
    int end = clamp(int(floor(last.x + MAP_SLACK)), 0, side - 1);
    for (int column = begin; column <= end; ++column) {
        vec2 span = clamp((vec2(column, column + 1) + vec2(-MAP_SLACK, MAP_SLACK) - first.x) * inverse, 0.0, 1.0);
        if (inverse == 0.0) span = vec2(0.0, 1.0);
        vec2 enters = mix(first.yz, last.yz, span.x);
        vec2 leaves = mix(first.yz, last.yz, span.y);
        int low = clamp(int(floor(min(enters.x, leaves.x) - MAP_SLACK)), 0, side - 1);
        int high = clamp(int(floor(max(enters.x, leaves.x) + MAP_SLACK)), 0, side - 1);
        uint near = floatBitsToUint(max(enters.y, leaves.y));
        for (int row = low; row <= high; ++row) {
            uvec2 texel = is_steep ? uvec2(row, column) : uvec2(column, row);
            atomicMax(silhouettes[map_row(sample_index, face, texel.y) + texel.x], near);
        }
    }
}

void main() {
    uint index = flat_invocation();
    uint sample_index = index / push.edge_count;
    if (sample_index >= push.sample_count) return;
    SilhouetteEdge edge = silhouette_edges[index - sample_index * push.edge_count];
    LightSource light = at_sample(of_kind(light_at(Lights, push.light)), sample_index);
    if_any (is_silhouette(edge, light)) {
        for (uint face = 0u; face < map_faces(); ++face) {
            vec3 from = in_face(face, light, edge.from);
            vec3 to = in_face(face, light, edge.to);
            vec2 span = vec2(0.0, 1.0);
            if (!is_parallel()) {
                // An edge that meets the light is cut where no shadow ray is as close.
                float least = 1e-6 * (abs(from.z) + abs(to.z)) + 1e-20;
                clip(from.z - least, to.z - least, span);
                clip(MAP_REACH * from.z - from.x, MAP_REACH * to.z - to.x, span);
                clip(MAP_REACH * from.z + from.x, MAP_REACH * to.z + to.x, span);
                clip(MAP_REACH * from.z - from.y, MAP_REACH * to.z - to.y, span);
                clip(MAP_REACH * from.z + from.y, MAP_REACH * to.z + to.y, span);
            }
            if_any (span.x <= span.y) draw(sample_index, face, on_face(mix(from, to, span.x)), on_face(mix(from, to, span.y)));
        }
    }
    if (!loops_completed(push.edge_count)) truncated_loops[0] = LOOP_TRUNCATED;
}
