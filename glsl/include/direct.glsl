// Light straight from a light to a surface, free of its colour. Include after types.glsl, math.glsl, bvh.glsl and lights.glsl.

// What a light's point sample `i` brings to a surface if nothing stands between, per unit of emission: see light_factor. `found` is
// the direction; its distance is 0 where there is none.
float open_factor(LightSource light, uint i, vec3 position, vec3 normal, vec3 shading, float area, out LightSample found) {
    light.emission = vec3(1.0);
    bool shines = sample_light(light, position, lattice_point(light, i), found);
    if (found.distance == 0.0) return 0.0;
    float cosine = dot(shading, found.direction);
    // A light behind the real surface does not shine through, wherever the shading normal points.
    if (!(shines && cosine > 0.0 && dot(normal, found.direction) > 0.0)) return 0.0;
    // Point to disc of the surface's area instead of 1/d²: finite at any distance. [Wallace]
    float inverse = 1.0 / found.distance;
    return cosine * found.irradiance.x / (1.0 + area / PI * inverse * inverse);
}

// Whether a ray is due to a sample that brings so much.
bool is_due(LightSample found, float factor, bool traces_all) { return found.distance != 0.0 && (factor > 0.0 || traces_all); }

// Irradiance per unit of the light's emission, from its point samples `first` to `end`, a shadow ray each: 1/m² of point and
// spot lights, sr of area lights, 1 of directional ones. `shading` is the surface's shading normal, `area` (m²) its extent.
// Rays that cannot bring light, from surfaces that face away or stand outside a cone, are left out unless `traces_all`.
float light_factor(LightSource light, uint first, uint end, bool traces_all, vec3 position, vec3 normal, vec3 shading, float area) {
    float sum = 0.0;
    for (uint i = first; i < end; ++i) {
        LightSample found;
        float factor = open_factor(light, i, position, normal, shading, area, found);
        if (!is_due(found, factor, traces_all)) continue;
        if (is_lit(position, normal, found)) sum += factor;
    }
    return sum / float(light.samples);
}
