// Photon maps: photons sorted by the bucket of their cell, and the lookup of photons around a
// surface point. [Jensen 1996] Include after types.glsl, math.glsl and sampling.glsl.

// A photon that arrived at a surface.
struct Photon {
    vec3 position;
    uint side;  // 2·triangle + (1 if the back side); NO_SIDE where the slot is empty
    vec3 flux;  // W
};

struct MapEntry {
    vec3 position;
    vec3 normal;  // unit geometric normal of its side
    vec3 flux;
};

// The cells of a map: cubes as wide as the radius of the density estimate.
struct PhotonGrid {
    vec3 low;
    float inverse_cell;  // 1/m
};

// Buckets that cells are hashed to. One more, the last of 16 bits, takes the empty slots.
const uint PHOTON_BUCKETS = 65535u;
const uint NO_ENTRY = 0xffffffffu;

ivec3 photon_cell(PhotonGrid grid, vec3 position) {
    precise vec3 scaled = (position - grid.low) * grid.inverse_cell;
    return ivec3(floor(scaled));
}

uint photon_bucket(ivec3 cell) { return hash(uint(cell.x), hash(uint(cell.y), uint(cell.z))) % PHOTON_BUCKETS; }

// Cell `index` of the 27 around and including `middle`.
ivec3 photon_neighbour(ivec3 middle, uint index) {
    return middle + ivec3(index % 3u, index / 3u % 3u, index / 9u) - 1;
}

// Two points count as one surface if their normals differ by less than 25° and the offset leaves
// the plane by less than a tenth of the radius.
const float SAME_NORMAL = 0.9;
const float SAME_PLANE = 0.1;

// The kernel of the density estimate: 1 - (d/r)², zero off the point's surface. Not normalised.
// [Epanechnikov 1969]
float photon_kernel(vec3 offset, vec3 normal, vec3 other_normal, float radius) {
    if (dot(normal, other_normal) < SAME_NORMAL || abs(dot(offset, normal)) > SAME_PLANE * radius) return 0.0;
    return max(0.0, 1.0 - dot(offset, offset) / (radius * radius));
}

// The sector of an offset, of sixteen equal ones around the normal: bit 0 x < 0, bit 1 y < 0, bit 2
// |y| > |x|, bit 3 in the half of that octant nearer to the diagonal.
uint reach_sector(vec2 along) {
    vec2 size = abs(along);
    bool is_steep = size.y > size.x;
    float ratio = min(size.x, size.y) / max(max(size.x, size.y), 1e-30);
    return uint(along.x < 0.0) | uint(along.y < 0.0) << 1 | uint(is_steep) << 2 | uint(ratio > 0.41421356) << 3;
}

// The middle of a sector, unit.
vec2 sector_direction(uint sector) {
    vec2 direction = (sector & 8u) != 0u ? vec2(0.83146961, 0.55557023) : vec2(0.98078528, 0.19509032);
    if ((sector & 4u) != 0u) direction = direction.yx;
    return mix(direction, -direction, bvec2((sector & 1u) != 0u, (sector & 2u) != 0u));
}

// Whether no wall separates a point from the position at `offset` on its surface. The reach is a
// byte a sector, in 1/255 of the radius; 255: no wall that near.
bool is_within_reach(uvec4 reach, vec3 normal, vec3 offset, float radius) {
    mat3 frame = frame_around(normal);
    vec2 along = vec2(dot(offset, frame[0]), dot(offset, frame[1]));
    uint sector = reach_sector(along);
    uint steps = (reach[sector >> 2] >> (8u * (sector & 3u))) & 255u;
    return steps == 255u || length(along) * 255.0 <= float(steps) * radius;
}
