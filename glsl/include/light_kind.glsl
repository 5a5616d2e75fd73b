// Kernels that handle one light are specialised to its kind, so that the compiler removes the code
// of the other kinds. Include after types.glsl.
layout(constant_id = 14) const uint LIGHT_KIND = 0u;

// The light with its kind fixed to LIGHT_KIND.
LightSource of_kind(LightSource light) {
    light.kind = LIGHT_KIND;
    if (LIGHT_KIND == LIGHT_AREA) return light;
    light.edge_u = vec3(0.0);
    light.edge_v = vec3(0.0);
    light.samples = 1u;
    light.stride = 1u;
    light.modulus = 1u;
    return light;
}

// One past the last of its point samples `first` to `end`.
uint end_of_kind(uint first, uint end) { return LIGHT_KIND == LIGHT_AREA ? end : first + 1u; }
