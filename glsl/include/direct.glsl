// Direct irradiance from one light, per unit emission. Include after types.glsl, math.glsl,
// bvh.glsl and lights.glsl.

// What a point sees of a light: samples that light it, samples that are hidden.
const uint SEES_LIT = 1u;
const uint SEES_HIDDEN = 2u;

// Distance in units of the widest sample spacing of an area light. Receivers nearer than NEAR take
// the closed form; from NEAR to twice NEAR it fades out.
const float NEAR = 4.0;
// Solid angle, sr, below which the closed form is not used: its sum of arcs loses all
// digits in f32.
const float LARGE = 1e-4;

// Term of the arc between two directions, of any length, in Lambert's sum for a receiver
// with that normal.
float arc(vec3 normal, vec3 from, vec3 to) {
    vec3 across = cross(from, to);
    float sine = length(across);
    return sine > 0.0 ? atan(sine, dot(from, to)) / sine * dot(normal, across) : 0.0;
}

// As `arc`, for the piece of an edge above the horizon. The outline crosses the horizon downwards
// at `leaves`, upwards at `returns`.
float arc_above(vec3 normal, vec3 from, vec3 to, inout vec3 leaves, inout vec3 returns) {
    float before = dot(normal, from);
    float after = dot(normal, to);
    if (before <= 0.0 && after <= 0.0) return 0.0;
    vec3 on_horizon = mix(from, to, before / (before - after));
    if (before < 0.0) returns = from = on_horizon;
    if (after < 0.0) leaves = to = on_horizon;
    return arc(normal, from, to);
}

// Unoccluded irradiance from a parallelogram of unit radiance, sr, for a receiver with that normal.
// `corner` is relative to the receiver. [Lambert 1760]
float parallelogram_irradiance(vec3 normal, vec3 corner, vec3 edge_u, vec3 edge_v) {
    vec3 leaves = vec3(0.0);
    vec3 returns = vec3(0.0);
    vec3 opposite = corner + edge_u + edge_v;
    float sum = arc_above(normal, corner, corner + edge_u, leaves, returns) + arc_above(normal, corner + edge_u, opposite, leaves, returns)
              + arc_above(normal, opposite, corner + edge_v, leaves, returns) + arc_above(normal, corner + edge_v, corner, leaves, returns);
    return 0.5 * abs(sum + arc(normal, leaves, returns));
}

// As `parallelogram_irradiance`, for a triangle.
float triangle_irradiance(vec3 normal, vec3 corner, vec3 edge_u, vec3 edge_v) {
    vec3 leaves = vec3(0.0);
    vec3 returns = vec3(0.0);
    float sum = arc_above(normal, corner, corner + edge_u, leaves, returns) + arc_above(normal, corner + edge_u, corner + edge_v, leaves, returns)
              + arc_above(normal, corner + edge_v, corner, leaves, returns);
    return 0.5 * abs(sum + arc(normal, leaves, returns));
}

// As `parallelogram_irradiance`, for the shape of an area light.
float shape_irradiance(LightSource light, vec3 normal, vec3 corner) {
    if ((light.shape & SHAPE_TRIANGLE) != 0u) return triangle_irradiance(normal, corner, light.edge_u, light.edge_v);
    return parallelogram_irradiance(normal, corner, light.edge_u, light.edge_v);
}

// Term of point sample `i` of an area light in `open_samples`; zero beyond the last sample.
// Advances `row` to the next sample.
float open_sample(LightSource light, vec3 corner, vec3 shading, uint i, inout uint row) {
    vec2 u = lattice_place(light, i, row);
    row = next_row(light, row);
    u = on_shape(light, u);
    vec3 to_light = corner + u.x * light.edge_u + u.y * light.edge_v;
    float inverse = 1.0 / max(dot(to_light, to_light), 1e-24);
    float brought = max(0.0, dot(shading, to_light) * inverse) * emitted_cosine(light, -to_light * inverse);
    return i < light.samples ? brought : 0.0;
}

// Unoccluded irradiance from the point samples of an area light of unit
// radiance; see `sample_weight`.
float open_samples(LightSource light, vec3 corner, vec3 shading) {
    float sum = 0.0;
    uint row = lattice_row(light, 0u);
    // Four an iteration, because of the iteration limit: see quirks.glsl.
    for (uint i = 0u; i < light.samples; i += 4u) {
        sum += open_sample(light, corner, shading, i, row);
        sum += open_sample(light, corner, shading, i + 1u, row);
        sum += open_sample(light, corner, shading, i + 2u, row);
        sum += open_sample(light, corner, shading, i + 3u, row);
    }
    return light.area * sum / float(light.samples);
}

// Weight of the point samples of an area light for a receiver of `area` m². Near the light, single
// samples would show as spots: the weight is the closed form over the unoccluded sum of the
// samples. Further off it bounds 1/d². Returns 1 for other lights.
float sample_weight(LightSource light, vec3 position, vec3 shading, float area) {
    if (light.kind != LIGHT_AREA) return 1.0;
    vec3 corner = light.position - position;
    float distance = max(length(corner + 0.5 * (light.edge_u + light.edge_v)), 1e-12);
    vec2 edges = vec2(length(light.edge_u), length(light.edge_v));
    // A lower bound of the distance to the nearest point of the light.
    float spacings = (distance - 0.5 * (edges.x + edges.y)) * sqrt(float(light.samples * sample_sets(light))) / max(edges.x, edges.y);
    float fraction = light.area > LARGE * distance * distance ? clamp(2.0 - spacings / NEAR, 0.0, 1.0) : 0.0;
    // Point to disc of the surface's area. [Wallace]
    float weight = 1.0 / (1.0 + area / (PI * distance * distance));
    if_any (fraction > 0.0) {
        float sum = open_samples(light, corner, shading);
        float whole = shape_irradiance(light, shading, corner);
        // Disc to disc: a receiver takes no more than the light emits, even from a light much
        // smaller than itself.
        if (sum > 0.0) weight = mix(weight, whole / (sum * (1.0 + whole * area / (PI * light.area))), fraction);
    }
    return weight;
}

// Applies `sample_weight` to the sum `found` once it includes the last sample.
float weighed(LightSource light, uint end, float found, vec3 position, vec3 shading, float area) {
    if_any (found > 0.0 && end == light.samples) found *= sample_weight(light, position, shading, area);
    return found;
}

// Whether a dispatch replaces the light of earlier frames.
bool is_first(uint flags, uint first_sample) { return first_sample == 0u && (flags & ADDS) == 0u; }

// Light of point samples at a receiver once those up to `end` are in: `found` by this dispatch,
// `before` by earlier ones, which handled other samples of the same part or, with ADDS, earlier
// parts. A part of several has all its samples in one dispatch.
float accumulated(LightSource light, uint flags, uint end, float before, float found, vec3 position, vec3 shading, float area) {
    if ((flags & ADDS) == 0u) return light.relative * weighed(light, end, before + found, position, shading, area);
    return before + light.relative * weighed(light, end, found, position, shading, area);
}

// Whether a receiver is on the surface that emits. Rounding decides which side of it the receiver
// is on, and one of them would be fully lit.
bool is_on_light(LightSource light, vec3 position) {
    if ((light.shape & SHAPE_SURFACE) == 0u) return false;
    return abs(dot(light.axis, light.position - position)) <= 4.0 * clear_distance(position);
}

// Unoccluded irradiance from the point sample at `u` per unit emission, before its weight; see
// `light_factor`. `found` is the direction to the sample; its distance is 0 if the light has
// no direction there.
float open_factor(LightSource light, vec2 u, vec3 position, vec3 normal, vec3 shading, float area, out LightSample found) {
    found.distance = 0.0;
    if (is_on_light(light, position)) return 0.0;
    light.emission = vec3(1.0);
    bool is_glossy = sample_light(light, position, u, found);
    if (found.distance == 0.0) return 0.0;
    float cosine = dot(shading, found.direction);
    // A light behind the surface has no effect, whatever the shading normal.
    if (!(is_glossy && cosine > 0.0 && dot(normal, found.direction) > 0.0)) return 0.0;
    float factor = cosine * found.irradiance.x;
    if (light.kind == LIGHT_AREA) return factor;
    // Point to disc of the surface's area instead of 1/d²: finite at any distance. [Wallace]
    float inverse = 1.0 / found.distance;
    return factor / (1.0 + area / PI * inverse * inverse);
}

// Whether a sample with this factor takes a shadow ray.
bool is_due(LightSample found, float factor, uint flags) { return found.distance != 0.0 && (factor > 0.0 || (flags & TRACES_ALL) != 0u); }

// Irradiance per unit of the light's emission from point samples `first` to `end`, one shadow
// ray each: 1/m² for point and spot lights, sr for area lights, 1 for directional lights.
// `shading` is the shading normal of the surface, `area` (m²) its extent. Samples that cannot
// bring light (behind the surface, outside a cone) take no ray unless TRACES_ALL. `weighed`
// completes the result. Adds to `seen`, see penumbra.glsl.
float light_factor(LightSource light, uint first, uint end, uint flags, vec3 position, vec3 normal, vec3 shading, float area, inout uint seen) {
    float sum = 0.0;
    uint row = lattice_row(light, first);
    for (uint i = first; i < end; ++i) {
        vec2 u = lattice_place(light, i, row);
        row = next_row(light, row);
        LightSample found;
        float factor = open_factor(light, u, position, normal, shading, area, found);
        if (!is_due(found, factor, flags)) continue;
        bool lit = is_lit(position, normal, found);
        if (factor > 0.0) seen |= lit ? SEES_LIT : SEES_HIDDEN;
        if (lit) sum += factor * passed_by_panes(shadow_ray(position, normal, found), light.shape >> CHANNEL_SHIFT);
    }
    return sum / float(light.samples);
}

float light_factor(LightSource light, uint first, uint end, uint flags, vec3 position, vec3 normal, vec3 shading, float area) {
    uint seen = 0u;
    return light_factor(light, first, end, flags, position, normal, shading, area, seen);
}
