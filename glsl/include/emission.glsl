// Rays that leave light sources. Include after types.glsl, math.glsl, sampling.glsl and
// lights.glsl.

struct EmittedRay {
    vec3 origin;
    vec3 direction;  // unit
    vec3 flux;       // over the ray's pdf, W: the mean over all rays is the light's power
};

// Samples a ray. `u` selects its direction, or the position on the disc of a light at infinity; `v`
// selects the position on an area light and the side, or the direction of a part of the sky.
EmittedRay emit(LightSource light, vec3 scene_centre, float scene_radius, vec2 u, vec3 v) {
    float azimuth = 2.0 * PI * u.y;
    vec2 around = vec2(cos(azimuth), sin(azimuth));
    if (light.kind == LIGHT_DIRECTIONAL || light.kind == LIGHT_SKY) {
        bool is_sky = light.kind == LIGHT_SKY;
        vec3 axis = is_sky ? -sky_direction(light, v.xy) : light.axis;
        vec3 on_disc = frame_around(axis) * vec3(sqrt(u.x) * around, -1.0);
        // The power of a light at infinity passes through the disc of the scene's bounding sphere.
        vec3 flux = PI * scene_radius * scene_radius * light.emission;
        if (is_sky) flux *= light.area;
        return EmittedRay(scene_centre + scene_radius * on_disc, axis, flux);
    }
    if (light.kind == LIGHT_AREA) {
        vec2 place = on_shape(light, v.xy);
        vec3 origin = light.position + place.x * light.edge_u + place.y * light.edge_v;
        bool is_two_sided = (light.shape & SHAPE_TWO_SIDED) != 0u;
        vec3 axis = is_two_sided && v.z < 0.5 ? -light.axis : light.axis;
        float area = is_two_sided ? 2.0 * light.area : light.area;
        return EmittedRay(origin, frame_around(axis) * sample_cosine(u), PI * area * light.emission);
    }
    // Uniform over the cone, or over the sphere: a height of the cap, which does not cancel in
    // narrow cones.
    bool is_spot = light.kind == LIGHT_SPOT;
    float half_sine = sin(0.5 * light.outer_angle);
    float cap = is_spot ? 2.0 * half_sine * half_sine : 2.0;
    float height = cap * u.x;
    vec3 local = vec3(sqrt(height * (2.0 - height)) * around, 1.0 - height);
    vec3 direction = is_spot ? frame_around(light.axis) * local : local;
    float falloff = is_spot ? spot_fraction(light, direction) : 1.0;
    return EmittedRay(light.position, direction, 2.0 * PI * cap * falloff * light.emission);
}
