// Shadow rays of the points of a workgroup to the point samples of a light. Points of one triangle
// that see a sample alike take one ray. Include after silhouettes.glsl and direct.glsl.
// The including shader binds the texels `Silhouettes` and the words `ray_count[]`, where it counts
// its rays and the rays that a neighbour's ray replaces. It defines
// IS_LIT(shaft, position, normal, to_light).

layout(constant_id = 19) const uint FINDS_ALIKE = 0u;  // see src/gpu/tuning.rs

const int MAX_TEXELS = 64;    // of the map that are looked at
const float OFF_EDGES = 32.0; // clear distances
const uint NEIGHBOURS = 16u;  // invocations whose points may take one ray

shared vec3 group_positions[64];
shared vec3 group_normals[64];  // of the surfaces that occlude
shared uint group_sides[64];
shared uint group_rays[64];     // invocations whose points take a ray
shared uint group_ray_count;
shared uint group_spared_count;
shared bool group_lit[64];

// Whether a sample of a light sees all of the points or none: no edge is before them, in all the
// texels that their hull may touch.
bool sees_alike(SeenBounds seen, uint sample_index) {
    float side = float(map_side());
    vec2 low = seen.low - MAP_SLACK;
    vec2 high = seen.high + MAP_SLACK;
    bool is_on_face = seen.nearest > 0.0 && all(greaterThanEqual(low, vec2(0.0))) && all(lessThan(high, vec2(side)));
    ivec2 first = ivec2(is_on_face ? low : vec2(0.0));
    ivec2 size = ivec2(is_on_face ? high : vec2(0.0)) - first + 1;
    int count = is_on_face && size.x <= MAX_TEXELS && size.y <= MAX_TEXELS ? size.x * size.y : 0;
    if (count == 0 || count > MAX_TEXELS) return false;
    uint nearest = 0u;
    ivec2 place = ivec2(0);
    for (int i = 0; i < count; ++i) {
        nearest = max(nearest, word_at(Silhouettes, map_row(sample_index, seen.face, uint(first.y + place.y)) + uint(first.x + place.x)));
        bool is_last = place.x + 1 == size.x;
        place = is_last ? ivec2(0, place.y + 1) : place + ivec2(1, 0);
    }
    float limit = seen.nearest * (1.0 - MAP_NEARER) - (is_parallel() ? MAP_NEARER : 0.0);
    return uintBitsToFloat(nearest) < limit;
}

// The neighbour before this invocation whose ray also tells what its own point sees; itself if no
// neighbour does. `side` is NO_SIDE where a point takes its own ray, or none.
uint teller_of(LightSource light, uint sample_index, uint flags, vec3 position, uint side) {
    uint own = gl_LocalInvocationIndex;
    if ((flags & (HAS_SILHOUETTES | TRACES_ALL)) != HAS_SILHOUETTES || side == NO_SIDE) return own;
    uint first = own / NEIGHBOURS * NEIGHBOURS;
    while (group_sides[first] != side) ++first;
    bool is_alike = false;
    if_any (first != own) {
        LightSource point = at_sample(light, sample_index);
        is_alike = sees_alike(seen_with(seen_from(point, position), point, group_positions[first]), sample_index);
    }
    return is_alike ? first : own;
}

// The side of the triangle that a point is on, for light_factor_in_group; NO_SIDE if direct light
// meets a smooth surface around the triangle instead.
uint flat_side(PixelSurface point) {
    if (point.side == NO_SIDE) return NO_SIDE;
    return (surface_at(point.side >> 1).sides & ROUNDED) == 0u ? point.side : NO_SIDE;
}

// Whether a point of a triangle is away from its edges. Closer, the offset of ray origins may put
// it behind the surface that meets the triangle there.
bool is_off_edges(vec3 position, uint triangle) {
    Corners t = corners_of(triangle);
    vec3 normal = surface_at(triangle).normal;
    vec3 a = t.p1 - t.p0, b = t.p2 - t.p1, c = t.p0 - t.p2;
    vec3 inside = vec3(dot(cross(a, position - t.p0), normal), dot(cross(b, position - t.p1), normal), dot(cross(c, position - t.p2), normal));
    float least = OFF_EDGES * clear_distance(position);
    return all(greaterThan(inside * inside, least * least * vec3(dot(a, a), dot(b, b), dot(c, c))));
}

// Whether the point of each invocation of a workgroup, which all call it, sees sample number
// `sample_index` of a light, at `u`. `side` is NO_SIDE where no neighbour can tell. Points without
// a ray are not lit.
bool is_lit_in_group(uint shaft, LightSource light, uint sample_index, vec2 u, uint flags, Receiver at, uint side, bool has_ray) {
    uint own = gl_LocalInvocationIndex;
    group_positions[own] = at.position;
    group_normals[own] = at.normal;
    group_sides[own] = has_ray ? side : NO_SIDE;
    if (own == 0u) group_ray_count = group_spared_count = 0u;
    barrier();
    uint teller = teller_of(light, sample_index, flags, at.position, group_sides[own]);
    if (has_ray && teller == own) group_rays[atomicAdd(group_ray_count, 1u)] = own;
    if (has_ray && teller != own) atomicAdd(group_spared_count, 1u);
    barrier();
    if (own < group_ray_count) {
        uint traced = group_rays[own];
        LightSample to_light;
        sample_light(light, group_positions[traced], u, to_light);
        group_lit[traced] = IS_LIT(shaft, group_positions[traced], group_normals[traced], to_light);
    }
    if (own == 0u) {
        atomicAdd(ray_count[0], group_ray_count);
        atomicAdd(ray_count[1], group_spared_count);
    }
    barrier();
    return has_ray && group_lit[teller];
}

// As light_factor, for each point of a workgroup, all of whose invocations call it. The points are
// those of the shaft, if there is one. `side` is that of the point's triangle, or NO_SIDE. Without
// `is_point`, an invocation has none.
float light_factor_in_group(uint shaft, LightSource light, uint first, uint end, uint flags, Receiver at, uint side, vec3 shading, float area,
                            bool is_point, inout uint seen) {
    if (is_point && side != NO_SIDE) side = is_off_edges(at.position, side >> 1) ? side : NO_SIDE;
    float sum = 0.0;
    uint row = lattice_row(light, first);
    for (uint i = first; i < end_of_kind(first, end); ++i) {
        vec2 u = lattice_place(light, i, row);
        row = next_row(light, row);
        LightSample found;
        float factor = open_factor(light, u, at.position, at.normal, shading, area, found);
        bool has_ray = is_point && is_due(found, factor, flags);
        bool lit = is_lit_in_group(shaft, light, i, u, flags, at, side, has_ray);
        if (has_ray && factor > 0.0) seen |= lit ? SEES_LIT : SEES_HIDDEN;
        if (lit) sum += factor * passed_by_panes(shadow_ray(at.position, at.normal, found), light.shape >> CHANNEL_SHIFT);
    }
    return sum / float(light.samples);
}
