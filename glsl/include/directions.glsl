// Direction bins of outgoing radiance: an equal-area map of the sphere to the unit square.
// [Clarberg 2008] Mirrors src/scene/directions.rs. Include after math.glsl.

// The bin of a unit direction among side × side.
uint direction_bin(vec3 direction, uint side) {
    vec2 flat_part = abs(direction.xy);
    float radius = sqrt(max(0.0, 1.0 - abs(direction.z)));
    float along = radius > 0.0 ? radius * atan(flat_part.y, flat_part.x) / (0.5 * PI) : 0.0;
    vec2 inner = vec2(radius - along, along);
    vec2 place = direction.z < 0.0 ? 1.0 - inner.yx : inner;
    vec2 signs = vec2(direction.x < 0.0 ? -1.0 : 1.0, direction.y < 0.0 ? -1.0 : 1.0);
    uvec2 bin = uvec2(clamp((0.5 + 0.5 * place * signs) * float(side), vec2(0.0), vec2(float(side) - 1.0)));
    return bin.y * side + bin.x;
}
