// Light straight from a light to a surface, free of its colour. Include after types.glsl, math.glsl, bvh.glsl and lights.glsl.

// Irradiance per unit of the light's emission, from its point samples `first` to `end`, a shadow ray each: 1/m² of point and
// spot lights, sr of area lights, 1 of directional ones. `shading` is the surface's shading normal, `area` (m²) its extent.
float light_factor(LightSource light, uint first, uint end, vec3 position, vec3 normal, vec3 shading, float area) {
    light.emission = vec3(1.0);
    float sum = 0.0;
    for (uint i = first; i < end; ++i) {
        LightSample found;
        if (!sample_light(light, position, lattice_point(light, i), found)) continue;
        float cosine = dot(shading, found.direction);
        // A light behind the real surface does not shine through, wherever the shading normal points.
        if (cosine <= 0.0 || dot(normal, found.direction) <= 0.0) continue;
        if (!is_lit(position, normal, found)) continue;
        // Point to disc of the surface's area instead of 1/d²: finite at any distance. [Wallace]
        float inverse = 1.0 / found.distance;
        sum += cosine * found.irradiance.x / (1.0 + area / PI * inverse * inverse);
    }
    return sum / float(light.samples);
}
