// The sky. The including shader binds `Background background[]` and `vec3 sky_texels[]`. Include
// after math.glsl.
layout(constant_id = 20) const uint HAS_EMISSION = 0u;  // 1: some surface emits, or there is a sky

// Texel of the sky, beyond its left and right edges from the other side.
vec3 sky_texel(Background sky, ivec2 place) {
    uint column = uint(place.x + int(sky.width)) % sky.width;
    uint row = uint(clamp(place.y, 0, int(sky.height) - 1));
    return sky_texels[row * sky.width + column];
}

// Radiance of the sky in a direction, without its tint; bilinear.
vec3 sky_along(vec3 direction) {
    Background sky = background[0];
    if (sky.width == 0u) return vec3(0.0);
    float azimuth = atan(direction.x, -direction.z);
    float row = acos(clamp(direction.y * inversesqrt(dot(direction, direction)), -1.0, 1.0)) / PI * float(sky.height) - 0.5;
    int top = int(floor(row));
    vec3 found;
    // Channels that are lights of their own may be turned differently.
    for (int channel = 0; channel < 3; ++channel) {
        float turns = fract((azimuth + sky.turn[channel]) / (2.0 * PI) + 0.5);
        float column = turns * float(sky.width) - 0.5;
        int left = int(floor(column));
        float upper = mix(sky_texel(sky, ivec2(left, top))[channel], sky_texel(sky, ivec2(left + 1, top))[channel], column - float(left));
        float lower = mix(sky_texel(sky, ivec2(left, top + 1))[channel], sky_texel(sky, ivec2(left + 1, top + 1))[channel], column - float(left));
        found[channel] = mix(upper, lower, row - float(top));
    }
    return found;
}

// Radiance of the sky in a direction.
vec3 background_along(vec3 direction) { return background[0].tint * sky_along(direction); }
