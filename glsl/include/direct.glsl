// Direct light of point lights, one shadow ray each. The including shader binds the scene and `lights`, and includes bvh.glsl.

// Irradiance at what a camera ray sees, W/m².
vec3 direct_light(PixelSurface pixel, uint light_count) {
    vec3 irradiance = vec3(0.0);
    if (pixel.side == NO_SIDE) return irradiance;
    vec3 normal = surfaces[pixel.side >> 1].normal;
    if ((pixel.side & 1u) != 0u) normal = -normal;
    for (uint i = 0u; i < light_count; ++i) {
        vec3 to_light = lights[i].position - pixel.position;
        float cosine = dot(pixel.normal, to_light);
        // A light behind the real surface does not shine through, wherever the shading normal points.
        if (cosine <= 0.0 || dot(normal, to_light) <= 0.0) continue;
        if (!is_visible(pixel.position, normal, lights[i].position)) continue;
        // Bounded by the pixel's own extent: a disc of that area cannot see more than half the light's sphere. [Wallace]
        float distance2 = dot(to_light, to_light);
        irradiance += lights[i].emission * (cosine * inversesqrt(distance2) / (distance2 + pixel.footprint / PI));
    }
    return irradiance;
}
