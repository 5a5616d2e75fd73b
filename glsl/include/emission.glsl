// Rays that leave light sources, and their power. Include after types.glsl, math.glsl, sampling.glsl and lights.glsl.

// A ray that leaves a light.
struct EmittedRay {
    vec3 origin;
    vec3 direction;  // unit
    vec3 flux;       // over the ray's pdf, W: the mean over all rays is the light's power
};

// ∫ falloff dω of a spot, sr. In terms that do not cancel in narrow cones: 2π(1 - cos m · sinc h) of the mean m and half the
// difference h of the two half-angles.
float spot_solid_angle(LightSource light) {
    float mean = 0.5 * (light.outer_angle + light.inner_angle);
    float h2 = 0.25 * (light.outer_angle - light.inner_angle) * (light.outer_angle - light.inner_angle);
    float lost = h2 / 6.0 * (1.0 - h2 / 20.0 * (1.0 - h2 / 42.0 * (1.0 - h2 / 72.0)));  // 1 - sinc h
    float sine = sin(0.5 * mean);
    return 2.0 * PI * (2.0 * sine * sine + cos(mean) * lost);
}

// Power that a light sends into the scene, W. A light at infinity: through the disc of the scene's bounding sphere.
vec3 light_power(LightSource light, float scene_radius) {
    float factor = 4.0 * PI;
    if (light.kind == LIGHT_SPOT) factor = spot_solid_angle(light);
    if (light.kind == LIGHT_AREA) factor = PI * light.area;
    if (light.kind == LIGHT_DIRECTIONAL) factor = PI * scene_radius * scene_radius;
    return factor * light.emission;
}

// Samples a ray: `u` picks its direction, or the place on the disc of a light at infinity; `v` the place on an area light.
EmittedRay emit(LightSource light, vec3 scene_centre, float scene_radius, vec2 u, vec2 v) {
    float azimuth = 2.0 * PI * u.y;
    vec2 around = vec2(cos(azimuth), sin(azimuth));
    if (light.kind == LIGHT_DIRECTIONAL) {
        vec3 on_disc = frame_around(light.axis) * vec3(sqrt(u.x) * around, -1.0);
        return EmittedRay(scene_centre + scene_radius * on_disc, light.axis, light_power(light, scene_radius));
    }
    if (light.kind == LIGHT_AREA) {
        vec3 origin = light.position + v.x * light.edge_u + v.y * light.edge_v;
        return EmittedRay(origin, frame_around(light.axis) * sample_cosine(u), light_power(light, scene_radius));
    }
    // Uniform over the cone, or over the sphere: a height of the cap, which does not cancel in narrow cones.
    bool is_spot = light.kind == LIGHT_SPOT;
    float half_sine = sin(0.5 * light.outer_angle);
    float cap = is_spot ? 2.0 * half_sine * half_sine : 2.0;
    float height = cap * u.x;
    vec3 local = vec3(sqrt(height * (2.0 - height)) * around, 1.0 - height);
    vec3 direction = is_spot ? frame_around(light.axis) * local : local;
    float falloff = is_spot ? spot_falloff(light, direction) : 1.0;
    return EmittedRay(light.position, direction, 2.0 * PI * cap * falloff * light.emission);
}
