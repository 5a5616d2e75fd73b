// Images of diffuse albedo: bilinear, decoded from sRGB before texels are mixed. Include after
// colour.glsl. The including shader binds the texels `Triangles`, `vec2 texture_coordinates[]`
// (three a triangle), `Texture textures[]` (one a material), and `uint texels[]`: the decoded
// values of the 256 codes as floats, then the images. Without HAS_TEXTURES none of them is read.

// Value of `Texture.is_clamped`: triangles have texels of their own, and beyond a triangle its
// nearest colour continues.
const uint CLAMPED_TO_TRIANGLE = 2u;

vec3 texel_at(Texture image, ivec2 place) {
    ivec2 size = ivec2(image.width, image.height);
    // `place` is at most one texel outside.
    ivec2 inside = image.is_clamped != 0u ? clamp(place, ivec2(0), size - 1) : (place + size) % size;
    uint codes = texels[image.first + uint(inside.y) * image.width + uint(inside.x)];
    return uintBitsToFloat(uvec3(texels[codes & 255u], texels[codes >> 8 & 255u], texels[codes >> 16 & 255u]));
}

// Colour of a material's image at a point of a triangle; white if it has no image.
vec3 image_at(uint material, uint triangle, vec3 barycentric) {
    vec3 colour = vec3(1.0);
    Texture image = textures[material];
    if_any (image.width != 0u) {
        if (image.is_clamped == CLAMPED_TO_TRIANGLE) {
            barycentric = max(barycentric, 0.0);
            barycentric /= barycentric.x + barycentric.y + barycentric.z;
        }
        vec2 uv = barycentric.x * texture_coordinates[3u * triangle] + barycentric.y * texture_coordinates[3u * triangle + 1u]
                + barycentric.z * texture_coordinates[3u * triangle + 2u];
        // Rows are stored from the top.
        vec2 place = vec2(uv.x, 1.0 - uv.y);
        place = image.is_clamped != 0u ? clamp(place, 0.0, 1.0) : place - floor(place);
        vec2 between = place * vec2(image.width, image.height) - 0.5;
        ivec2 low = ivec2(floor(between));
        vec2 fraction = between - vec2(low);
        vec3 above = mix(texel_at(image, low), texel_at(image, low + ivec2(1, 0)), fraction.x);
        vec3 below = mix(texel_at(image, low + ivec2(0, 1)), texel_at(image, low + ivec2(1)), fraction.x);
        colour = mix(above, below, fraction.y);
    }
    return colour;
}

// Weights of a triangle's corners at a point of its plane.
vec3 barycentric_at(uint triangle, vec3 position) {
    Corners t = corners_of(triangle);
    vec3 normal = cross(t.p1 - t.p0, t.p2 - t.p0);
    vec3 from_p0 = position - t.p0;
    vec2 weights = vec2(dot(cross(from_p0, t.p2 - t.p0), normal), dot(cross(t.p1 - t.p0, from_p0), normal)) / dot(normal, normal);
    return vec3(1.0 - weights.x - weights.y, weights);
}
