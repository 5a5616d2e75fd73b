// Light straight from a light to a surface, free of its colour. Include after types.glsl,
// math.glsl, bvh.glsl and lights.glsl.

// Area lights are integrated in closed form by what is nearer than twice so many of the widest
// spacings of their samples, and in part from once.
const float NEAR = 4.0;
// But for those of a smaller solid angle, sr: f32 has no such sum of arcs.
const float LARGE = 1e-4;

// What the arc between two directions of any length adds to Lambert's sum, for a receiver with that
// normal.
float arc(vec3 normal, vec3 from, vec3 to) {
    vec3 across = cross(from, to);
    float sine = length(across);
    return sine > 0.0 ? atan(sine, dot(from, to)) / sine * dot(normal, across) : 0.0;
}

// As arc, of what of an edge stands above the horizon. Where the outline goes below it is in
// `leaves`, where it comes back in `returns`.
float arc_above(vec3 normal, vec3 from, vec3 to, inout vec3 leaves, inout vec3 returns) {
    float before = dot(normal, from);
    float after = dot(normal, to);
    if (before <= 0.0 && after <= 0.0) return 0.0;
    vec3 on_horizon = mix(from, to, before / (before - after));
    if (before < 0.0) returns = from = on_horizon;
    if (after < 0.0) leaves = to = on_horizon;
    return arc(normal, from, to);
}

// What a parallelogram of unit radiance brings to a receiver with that normal, sr, if nothing
// stands between. `corner` is where it begins, as seen from there. [Lambert 1760]
float parallelogram_irradiance(vec3 normal, vec3 corner, vec3 edge_u, vec3 edge_v) {
    vec3 leaves = vec3(0.0);
    vec3 returns = vec3(0.0);
    vec3 opposite = corner + edge_u + edge_v;
    float sum = arc_above(normal, corner, corner + edge_u, leaves, returns) + arc_above(normal, corner + edge_u, opposite, leaves, returns)
              + arc_above(normal, opposite, corner + edge_v, leaves, returns) + arc_above(normal, corner + edge_v, corner, leaves, returns);
    return 0.5 * abs(sum + arc(normal, leaves, returns));
}

// What point sample `i` of an area light adds to open_samples; nothing behind the last. `row` is
// the next one's after that.
float open_sample(LightSource light, vec3 corner, vec3 shading, uint i, inout uint row) {
    vec2 u = lattice_place(light, i, row);
    row = next_row(light, row);
    vec3 to_light = corner + u.x * light.edge_u + u.y * light.edge_v;
    float inverse = 1.0 / max(dot(to_light, to_light), 1e-24);
    float brought = max(0.0, dot(shading, to_light) * inverse) * max(0.0, -dot(light.axis, to_light) * inverse);
    return i < light.samples ? brought : 0.0;
}

// What the point samples of an area light of unit radiance add up to if nothing stands between: see
// sample_weight.
float open_samples(LightSource light, vec3 corner, vec3 shading) {
    float sum = 0.0;
    uint row = lattice_row(light, 0u);
    // Four an iteration, because lavapipe limits their number: see loop_limit.glsl.
    for (uint i = 0u; i < light.samples; i += 4u) {
        sum += open_sample(light, corner, shading, i, row);
        sum += open_sample(light, corner, shading, i + 1u, row);
        sum += open_sample(light, corner, shading, i + 2u, row);
        sum += open_sample(light, corner, shading, i + 3u, row);
    }
    return light.area * sum / float(light.samples);
}

// What weighs the point samples of an area light for a receiver of that area (m²): beside the light
// its irradiance in closed form over what they add up to if nothing stands between, for there they
// would be spots; further off the bounded form of 1/d². 1 for other lights.
float sample_weight(LightSource light, vec3 position, vec3 shading, float area) {
    if (light.kind != LIGHT_AREA) return 1.0;
    vec3 corner = light.position - position;
    float distance = max(length(corner + 0.5 * (light.edge_u + light.edge_v)), 1e-12);
    vec2 edges = vec2(length(light.edge_u), length(light.edge_v));
    // What is nearest of the light is hardly nearer than that.
    float spacings = (distance - 0.5 * (edges.x + edges.y)) * sqrt(float(light.samples)) / max(edges.x, edges.y);
    float share = light.area > LARGE * distance * distance ? clamp(2.0 - spacings / NEAR, 0.0, 1.0) : 0.0;
    // Point to disc of the surface's area. [Wallace]
    float weight = 1.0 / (1.0 + area / (PI * distance * distance));
    for (bool is_due = share > 0.0; is_due; is_due = false) {
        float sum = open_samples(light, corner, shading);
        float whole = parallelogram_irradiance(shading, corner, light.edge_u, light.edge_v);
        // Disc to disc: the receiver takes no more than the light sends, however small that is
        // beside it.
        if (sum > 0.0) weight = mix(weight, whole / (sum * (1.0 + whole * area / (PI * light.area))), share);
    }
    return weight;
}

// What point samples up to `end` were found to bring, weighed once they are all.
float weighed(LightSource light, uint end, float found, vec3 position, vec3 shading, float area) {
    for (bool is_due = found > 0.0 && end == light.samples; is_due; is_due = false) found *= sample_weight(light, position, shading, area);
    return found;
}

// What a light's point sample at `u` brings to a surface if nothing stands between, per unit of
// emission, before its weight: see light_factor. `found` is the direction; its distance is 0 where
// there is none.
float open_factor(LightSource light, vec2 u, vec3 position, vec3 normal, vec3 shading, float area, out LightSample found) {
    light.emission = vec3(1.0);
    bool is_glossy = sample_light(light, position, u, found);
    if (found.distance == 0.0) return 0.0;
    float cosine = dot(shading, found.direction);
    // A light behind the real surface does not reach through, wherever the shading normal points.
    if (!(is_glossy && cosine > 0.0 && dot(normal, found.direction) > 0.0)) return 0.0;
    float factor = cosine * found.irradiance.x;
    if (light.kind == LIGHT_AREA) return factor;
    // Point to disc of the surface's area instead of 1/d²: finite at any distance. [Wallace]
    float inverse = 1.0 / found.distance;
    return factor / (1.0 + area / PI * inverse * inverse);
}

// Whether a ray is due to a sample that brings so much.
bool is_due(LightSample found, float factor, bool traces_all) { return found.distance != 0.0 && (factor > 0.0 || traces_all); }

// Irradiance per unit of the light's emission, from its point samples `first` to `end`, a shadow
// ray each: 1/m² of point and spot lights, sr of area lights, 1 of directional ones. `shading` is
// the surface's shading normal, `area` (m²) its extent. Rays that cannot bring light, from surfaces
// that face away or stand outside a cone, are left out unless `traces_all`. To be weighed.
float light_factor(LightSource light, uint first, uint end, bool traces_all, vec3 position, vec3 normal, vec3 shading, float area) {
    float sum = 0.0;
    uint row = lattice_row(light, first);
    for (uint i = first; i < end; ++i) {
        vec2 u = lattice_place(light, i, row);
        row = next_row(light, row);
        LightSample found;
        float factor = open_factor(light, u, position, normal, shading, area, found);
        if (!is_due(found, factor, traces_all)) continue;
        if (is_lit(position, normal, found)) sum += factor;
    }
    return sum / float(light.samples);
}
