// Parts of lights, for kernels that choose a point at random. Include after lights.glsl.

// A part of the light, chosen by power with the random number `u`; its emission is divided by the
// probability. A light of one part is returned as it is.
LightSource chosen_part(LightSource light, float u) {
    if (light.kind != LIGHT_GROUP) return light;
    // The first part whose cumulative probability exceeds u.
    uint low = light.stride;
    uint high = light.stride + light.modulus - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (u < light_at(Lights, middle).inner_angle) high = middle;
        else low = middle + 1u;
    }
    LightSource part = light_at(Lights, low);
    float before = low == light.stride ? 0.0 : light_at(Lights, low - 1u).inner_angle;
    part.emission = light.emission * (part.relative / (part.inner_angle - before));
    return part;
}
