// Ray traversal of the compressed wide BVH, closest hit and any hit. [Ylitie], triangle test [Woop]
// The including shader binds the texels `Nodes`. Include after texels.glsl and triangles.glsl.

Node node_at(uint index) {
    if (USE_BUFFER_DEVICE_ADDRESS != 0u) return NodeList(texelFetch(Nodes, 0).xy).items[index];
    int first = int(NODE_TEXELS * index);
    return Node(texelFetch(Nodes, first), texelFetch(Nodes, first + 1), texelFetch(Nodes, first + 2), texelFetch(Nodes, first + 3),
                texelFetch(Nodes, first + 4));
}

struct Ray {
    vec3 origin;
    vec3 direction;  // of any length, the unit of t
    float t_max;
};

struct Hit {
    float t;
    uint triangle;
    vec3 barycentric;  // weights of p0, p1, p2
};

// The loader (src/scene/bvh.rs) refuses deeper trees, and trees whose node indices exceed 24 bits.
const uint STACK_SIZE = 32u;

// Watertight ray–triangle test: edge functions in a space sheared along the ray. An edge function
// of exactly zero counts as inside, so that a ray through a shared edge or corner hits at least one
// triangle. `precise` forbids the contraction that would make the two sides of an edge disagree.
struct Shear {
    uint axis;   // dominant axis of the direction
    vec3 scale;  // shear x, shear y, 1 / dominant component
};

vec3 rotate_axes(vec3 v, uint axis) { return axis == 0u ? v.yzx : axis == 1u ? v.zxy : v; }

Shear shear_along(vec3 direction) {
    vec3 size = abs(direction);
    uint axis = size.x > size.y ? (size.x > size.z ? 0u : 2u) : (size.y > size.z ? 1u : 2u);
    vec3 d = rotate_axes(direction, axis);
    return Shear(axis, vec3(d.xy, 1.0) / d.z);
}

// A hole of a triangle is met only if `meets_holes`.
bool intersect_triangle(uint index, vec3 origin, Shear shear, const bool meets_holes, inout Hit hit) {
    Corners triangle = corners_of(index);
    precise vec3 a = rotate_axes(triangle.p0 - origin, shear.axis);
    precise vec3 b = rotate_axes(triangle.p1 - origin, shear.axis);
    precise vec3 c = rotate_axes(triangle.p2 - origin, shear.axis);
    precise vec2 as = a.xy - shear.scale.xy * a.z;
    precise vec2 bs = b.xy - shear.scale.xy * b.z;
    precise vec2 cs = c.xy - shear.scale.xy * c.z;
    precise vec3 edge = vec3(cs.x * bs.y - cs.y * bs.x, as.x * cs.y - as.y * cs.x, bs.x * as.y - bs.y * as.x);
    if (any(lessThan(edge, vec3(0.0))) && any(greaterThan(edge, vec3(0.0)))) return false;
    precise float determinant = edge.x + edge.y + edge.z;
    if (determinant == 0.0) return false;
    float inverse = 1.0 / determinant;
    // The distance along the ray follows from the plane. A mean of the corners' distances is off by
    // more than the clear distance in slivers: by a millimetre in one of 22 m by 2 cm.
    vec3 normal = rotate_axes(cross(triangle.p1 - triangle.p0, triangle.p2 - triangle.p0), shear.axis);
    float t = shear.scale.z * dot(normal, a) / (dot(normal.xy, shear.scale.xy) + normal.z);
    if (!(t > 0.0 && t < hit.t)) return false;
    if (HAS_CUTOUTS != 0u && !meets_holes && is_hole(index, edge * inverse)) return false;
    hit = Hit(t, index, edge * inverse);
    return true;
}

vec3 node_origin(Node node) { return uintBitsToFloat(node.frame.xyz); }

// Cell size of the quantised planes of a node.
vec3 node_cell(Node node) {
    uint exponents = node.frame.w;
    return uintBitsToFloat(uvec3(exponents << 23, exponents << 15, exponents << 7) & 0x7f800000u);
}

// Children of a node that the ray may enter: bits 24-31 inner children in visiting order, 0-23 leaf
// triangles. The slabs are widened by their rounding error, so that no ray misses the box of a
// triangle that it hits.
uint intersect_children(Node node, vec3 origin, vec3 inverse_direction, uint octant_inverse4, float t_max) {
    vec3 cell = node_cell(node) * inverse_direction;
    vec3 base = (node_origin(node) - origin) * inverse_direction;
    vec3 slack = 4e-7 * (abs(base) + 255.0 * abs(cell));
    vec3 base_near = base - slack;
    vec3 base_far = base + slack;
    bvec3 flip = lessThan(inverse_direction, vec3(0.0));
    uint hits = 0u;
    for (uint half_index = 0u; half_index < 2u; ++half_index) {
        uint meta = node.children[2u + half_index];
        uint inner = (((meta & (meta << 1)) & 0x10101010u) >> 4) * 0xffu;
        uint bit_index = (meta ^ (octant_inverse4 & inner)) & 0x1f1f1f1fu;
        uint child_bits = (meta >> 5) & 0x07070707u;
        uvec3 low = uvec3(node.x_planes[half_index], node.y_planes[half_index], node.z_planes[half_index]);
        uint high_index = 2u + half_index;
        uvec3 high = uvec3(node.x_planes[high_index], node.y_planes[high_index], node.z_planes[high_index]);
        uvec3 near = mix(low, high, flip);
        uvec3 far = mix(high, low, flip);
        for (uint shift = 0u; shift < 32u; shift += 8u) {
            vec3 t_near = vec3((near >> shift) & 0xffu) * cell + base_near;
            vec3 t_far = vec3((far >> shift) & 0xffu) * cell + base_far;
            // Floats that are not negative compare alike as integers, without a case for NaN.
            ivec3 near_bits = floatBitsToInt(t_near);
            ivec3 far_bits = floatBitsToInt(t_far);
            int enter = max(max(near_bits.x, near_bits.y), max(near_bits.z, 0));
            int leave = min(min(far_bits.x, far_bits.y), min(far_bits.z, floatBitsToInt(t_max)));
            if (enter <= leave) {
                hits |= ((child_bits >> shift) & 0xffu) << ((bit_index >> shift) & 0xffu);
            }
        }
    }
    return hits;
}

// A component of zero would turn a slab test into 0·∞; 1e-20 of a metre moves nothing.
vec3 without_zeros(vec3 direction) {
    return mix(direction, mix(vec3(1e-20), vec3(-1e-20), lessThan(direction, vec3(0.0))), lessThan(abs(direction), vec3(1e-20)));
}

// What a walk looks for: the closest hit, any hit, the closest hit with holes as surface, or the
// colours of all panes.
const uint CLOSEST = 0u;
const uint ANY = 1u;
const uint CLOSEST_WITH_HOLES = 2u;
const uint PANES = 3u;

// A hit in (0, t_max) below the node `root`. Returns whether there is one. Afterwards the same walk
// visits `more` further roots, which stand in `others` from `first` on, the last one first: one
// walk, so that no lane waits for the others at each root. Instead, a walk for panes multiplies
// `passed` by their colours.
bool walk(uint root, usamplerBuffer others, uint first, uint more, Ray ray, const uint wanted, inout vec3 passed, out Hit hit) {
    hit = Hit(ray.t_max, 0u, vec3(0.0));
    bool found = false;
    vec3 direction = without_zeros(ray.direction);
    vec3 inverse_direction = 1.0 / direction;
    Shear shear = shear_along(direction);
    uint octant = (direction.x < 0.0 ? 0u : 4u) | (direction.y < 0.0 ? 0u : 2u) | (direction.z < 0.0 ? 0u : 1u);
    uint octant_inverse4 = octant * 0x01010101u;

    // Stack entries: a node (bits 0-23) and its unvisited children (24-31). The node is loaded
    // again when popped: a stack of one word an entry costs less.
    uint stack[STACK_SIZE];
    uint depth = 0u;
    uint index = root;
    while (true) {
        Node node = node_at(index);
        uint hits = intersect_children(node, ray.origin, inverse_direction, octant_inverse4, hit.t);
        for (uint leaf = hits & 0x00ffffffu; leaf != 0u; leaf &= leaf - 1u) {
            if (!intersect_triangle(node.children.y + uint(findLSB(leaf)), ray.origin, shear, wanted == CLOSEST_WITH_HOLES, hit)) continue;
            if (wanted == PANES) {
                passed *= pane_colour(hit.triangle);
                hit.t = ray.t_max;
            } else {
                found = true;
                if (wanted == ANY) return true;
            }
        }
        uint left = hits & 0xff000000u;
        if (left == 0u) {
            if (depth == 0u) {
                if (more == 0u) break;
                index = word_at(others, first + --more);
                continue;
            }
            uint popped = stack[--depth];
            index = popped & 0xffffffu;
            left = popped & 0xff000000u;
            node = node_at(index);
        }
        uint bit = uint(findMSB(left));
        left &= ~(1u << bit);
        if (left != 0u) stack[depth++] = left | index;
        uint slot = (bit - 24u) ^ (octant_inverse4 & 0xffu);
        index = node.children.x + bitCount(node.frame.w >> 24 & ~(0xffffffffu << slot));
    }
    return found;
}

bool trace_from(uint root, usamplerBuffer others, uint first, uint more, Ray ray, const bool any_hit, out Hit hit) {
    vec3 passed = vec3(1.0);
    return walk(root, others, first, more, ray, any_hit ? ANY : CLOSEST, passed, hit);
}

// Fraction of light of each colour that panes let pass along a ray up to its t_max.
vec3 passed_by_panes(Ray ray) {
    vec3 passed = vec3(1.0);
    Hit hit;
    if (HAS_PANES != 0u) walk(pane_root(), Nodes, 0u, 0u, ray, PANES, passed, hit);
    return passed;
}

// The same for light of one channel; 0: of all, which pass alike.
float passed_by_panes(Ray ray, uint channel) {
    if (HAS_PANES == 0u) return 1.0;
    return passed_by_panes(ray)[channel == 0u ? 0 : int(channel) - 1];
}

// As `trace_from`, over the whole scene.
bool trace(Ray ray, const bool any_hit, out Hit hit) { return trace_from(0u, Nodes, 0u, 0u, ray, any_hit, hit); }

// Closest hit over the whole scene, with holes as surface.
bool trace_with_holes(Ray ray, out Hit hit) {
    vec3 passed = vec3(1.0);
    return walk(0u, Nodes, 0u, 0u, ray, CLOSEST_WITH_HOLES, passed, hit);
}

// Some 32 units in the last place.
const float CLEAR = 1.0 / 262144.0;

float largest_of(vec3 v) { return max(v.x, max(v.y, v.z)); }

// More than the rounding error of any position: it scales with the scene's largest coordinate.
float scene_clear_distance() {
    Node root = node_at(0);
    vec3 low = node_origin(root);
    return CLEAR * largest_of(max(abs(low), abs(low + 255.0 * node_cell(root))));
}

// Offset of ray origins from surfaces, at a position. A position is rounded in units of the corners
// of its triangle, which may reach the scene's edge. If a scene has regions of small cells,
// triangles are as small as their distance from these (src/scene/cell_sizes.rs).
float clear_distance(vec3 p) {
    return HAS_REGIONS == 0u ? scene_clear_distance() : CLEAR * max(largest_of(abs(p)), region_side());
}

// The least clear distance in a box.
float least_clear_distance(vec3 low, vec3 high) {
    return clear_distance(max(vec3(0.0), max(low, -high)));
}

// Moves a ray origin off its surface, towards `normal`.
vec3 offset_origin(vec3 p, vec3 normal) { return p + clear_distance(p) * normal; }

// Position of a hit, interpolated from the triangle's corners, so that it lies on the surface
// whatever the ray's length. It also stays off the triangle's edges: rounding may put a point on an
// edge behind the surface that meets it there, and a path that continues from there escapes. Four
// clear distances suffice for walls that meet at 15° or more.
vec3 hit_position(Hit hit) {
    Corners t = corners_of(hit.triangle);
    vec3 edges = vec3(distance(t.p1, t.p2), distance(t.p2, t.p0), distance(t.p0, t.p1));
    vec3 least = 4.0 * clear_distance(t.p0) * edges / length(cross(t.p1 - t.p0, t.p2 - t.p0));
    vec3 weights = max(hit.barycentric, min(least, 0.25));
    return (weights.x * t.p0 + weights.y * t.p1 + weights.z * t.p2) / (weights.x + weights.y + weights.z);
}
