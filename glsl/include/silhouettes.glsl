// Maps of the silhouettes around a light, one for each of its point samples: for each texel of
// directions, how near to the light the nearest edge is at which a shadow may end. Points of one
// triangle see a sample alike if no such edge is between them and the sample. Include after
// light_kind.glsl, lights.glsl and bvh.glsl.

// Texels of a face. A map is a cube of six around a sample, or one face for a directional light.
const uint POINT_SIDE = 512u;
const uint AREA_SIDE = 256u;
const uint PARALLEL_SIDE = 1024u;
const float MAP_REACH = 1.0625;  // half width of a face at distance 1: faces overlap, so that what is small is on one
const float MAP_SLACK = 0.02;    // texels; rounding moves no point as far
const float MAP_NEARER = 1e-4;   // relative; an edge is beyond a point if it is this much farther

bool is_parallel() { return LIGHT_KIND == LIGHT_DIRECTIONAL; }
uint map_side() { return is_parallel() ? PARALLEL_SIDE : LIGHT_KIND == LIGHT_AREA ? AREA_SIDE : POINT_SIDE; }
uint map_faces() { return is_parallel() ? 1u : 6u; }

// First texel of a row of the map of a sample.
uint map_row(uint sample_index, uint face, uint row) { return ((sample_index * map_faces() + face) * map_side() + row) * map_side(); }

// The light at one of its point samples alone: its position is that of the sample.
LightSource at_sample(LightSource light, uint sample_index) {
    if (LIGHT_KIND != LIGHT_AREA) return light;
    vec2 u = on_shape(light, lattice_point(light, sample_index));
    light.position += u.x * light.edge_u + u.y * light.edge_v;
    return light;
}

// A point in the frame of a face: x and y across it, z its distance from the light along its axis.
vec3 in_face(uint face, LightSource light, vec3 position) {
    if (is_parallel()) {
        // The box of the tree's root, and with it all points, is in the face.
        uvec4 frame = node_at(0u).frame;
        vec3 extent = 256.0 * uintBitsToFloat((uvec3(frame.w) >> uvec3(0u, 8u, 16u) & 255u) << 23);
        float radius = 0.5 * length(extent);
        vec3 apart = position - (uintBitsToFloat(frame.xyz) + 0.5 * extent);
        vec3 side = normalize(cross(light.axis, abs(light.axis.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
        return vec3(dot(side, apart), dot(cross(light.axis, side), apart), dot(light.axis, apart) + 1.01 * radius) / (1.01 * radius);
    }
    vec3 turned = rotate_axes(position - light.position, face >> 1u);
    return vec3(turned.xy, (face & 1u) != 0u ? -turned.z : turned.z);
}

// A point in the frame of a face, on the face in texels, and how near to the light it is: a
// number above zero that is linear along lines on the face.
vec3 on_face(vec3 inside) {
    if (is_parallel()) return vec3((0.5 + 0.5 * inside.xy) * float(PARALLEL_SIDE), 2.0 - inside.z);
    float inverse = 1.0 / inside.z;
    return vec3((0.5 + (0.5 / MAP_REACH) * inside.xy * inverse) * float(map_side()), inverse);
}

// Where a light sees some points.
struct SeenBounds {
    uint face;
    vec2 low;       // bounds in texels
    vec2 high;
    float nearest;  // how near the farthest is; not above zero: they are not on one face
};

SeenBounds seen_with(SeenBounds seen, LightSource light, vec3 position) {
    vec3 inside = in_face(seen.face, light, position);
    vec3 place = on_face(inside);
    float near = is_parallel() || inside.z > 0.0 ? place.z : -1.0;
    return SeenBounds(seen.face, min(seen.low, place.xy), max(seen.high, place.xy), min(seen.nearest, near));
}

SeenBounds seen_from(LightSource light, vec3 position) {
    vec3 apart = position - light.position;
    vec3 size = abs(apart);
    uint axis = size.x > size.y ? (size.x > size.z ? 0u : 2u) : (size.y > size.z ? 1u : 2u);
    uint face = is_parallel() ? 0u : 2u * axis + uint(apart[axis] < 0.0);
    return seen_with(SeenBounds(face, vec2(1e30), vec2(-1e30), 1e30), light, position);
}
