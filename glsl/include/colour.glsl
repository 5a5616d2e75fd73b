// Packed colours of images. The diffuse albedo of a material is a separate factor, so that it stays
// editable. Only scenes with images have such colours.

layout(constant_id = 9) const uint HAS_TEXTURES = 0;  // 1 in a scene with images

// Square roots in 11, 11 and 10 bits, so that dark colours keep their digits; 0 and 1 are exact.
uint pack_colour(vec3 colour) {
    uvec3 roots = uvec3(sqrt(clamp(colour, 0.0, 1.0)) * vec3(2047.0, 2047.0, 1023.0) + 0.5);
    return roots.x | roots.y << 11 | roots.z << 22;
}

vec3 unpack_colour(uint packed) {
    vec3 roots = vec3(packed & 2047u, packed >> 11 & 2047u, packed >> 22) / vec3(2047.0, 2047.0, 1023.0);
    return roots * roots;
}
