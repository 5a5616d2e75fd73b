// Corners of a triangle, and its holes. The including shader binds the texels `Triangles`.

// 1 if the bound list of triangles has opacity micromaps; it follows from the bindings.
layout(constant_id = 16) const uint HAS_CUTOUTS = 0;
// 1 if the bound list of nodes has a second tree, of panes; it follows from the bindings.
layout(constant_id = 17) const uint HAS_PANES = 0;
// 1 if some regions of the scene have smaller cells; it follows from the bindings.
layout(constant_id = 18) const uint HAS_REGIONS = 0;

struct Corners {
    vec3 p0;
    vec3 p1;
    vec3 p2;
};

Corners corners_of(uint index) {
    if (USE_BUFFER_DEVICE_ADDRESS != 0u) {
        Triangle t = TriangleList(texelFetch(Triangles, 0).xy).items[index];
        return Corners(t.p0.xyz, t.p1.xyz, t.p2.xyz);
    }
    int first = int(TRIANGLE_TEXELS * index);
    return Corners(uintBitsToFloat(texelFetch(Triangles, first).xyz), uintBitsToFloat(texelFetch(Triangles, first + 1).xyz),
                   uintBitsToFloat(texelFetch(Triangles, first + 2).xyz));
}

// A word of the list: those of the triangles, then those of their opacity micromaps.
uint triangle_word(uint index) {
    if (USE_BUFFER_DEVICE_ADDRESS != 0u) return WordList(texelFetch(Triangles, 0).xy).items[index];
    return texelFetch(Triangles, int(index >> 2))[index & 3u];
}

const uint TRIANGLE_WORDS = 4u * TRIANGLE_TEXELS;

// Root of the tree of panes. Triangle 0 stores it.
uint pane_root() { return triangle_word(11u) & 0xffffffu; }

// Side of the region with the smallest cells, rounded down to a power of two, metres. Triangle 0
// stores the exponent.
float region_side() { return uintBitsToFloat(triangle_word(11u) >> 24 << 23); }

// Fraction of light of each colour that a pane lets pass.
vec3 pane_colour(uint index) {
    uint packed = triangle_word(TRIANGLE_WORDS * index + 11u);
    return vec3(packed & 2047u, packed >> 11 & 2047u, packed >> 22) / vec3(2047.0, 2047.0, 1023.0);
}

// Subdivision level of a triangle's opacity micromap.
uint micromap_level(uint index) { return triangle_word(TRIANGLE_WORDS * index + 7u); }

bool has_holes(uint index) { return HAS_CUTOUTS != 0u && triangle_word(TRIANGLE_WORDS * index + 3u) != 0u; }

// Whether a triangle has a hole at a point. A micro-triangle is a hole if its bit is set;
// src/scene/opacity.rs numbers them.
bool is_hole(uint index, vec3 barycentric) {
    if (!has_holes(index)) return false;
    uint parts = 1u << micromap_level(index);
    vec2 place = clamp(barycentric.yz, 0.0, 1.0) * float(parts);
    uint row = min(uint(place.x), parts - 1u);
    uint left = parts - row;
    uint column = min(uint(place.y), left - 1u);
    bool is_far = place.x - float(row) + place.y - float(column) > 1.0 && column + 1u < left;
    uint number = parts * parts - left * left + 2u * column + uint(is_far);
    uint first = triangle_word(TRIANGLE_WORDS * index + 3u);
    return (triangle_word(first + (number >> 5)) >> (number & 31u) & 1u) != 0u;
}
