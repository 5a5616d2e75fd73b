// Light that surfaces send to a viewer. The including shader binds `vec4 emitted[]`. Include after
// surfaces.glsl.

// Radiance that a side of a material emits. `emitted` holds it, and in w the sides: 0 the front, 1
// both, -1 the back.
vec3 emitted_by(uint material, bool is_back) {
    vec4 emission = emitted[material];
    return emission.w == (is_back ? 0.0 : -1.0) ? vec3(0.0) : emission.xyz;
}

// Radiance that a triangle emits against the direction of a ray that meets it.
vec3 emitted_against(uint triangle, vec3 direction) {
    Surface surface = surface_at(triangle);
    return emitted_by(surface.material, dot(surface.normal, direction) > 0.0);
}
