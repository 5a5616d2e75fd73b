// A map of the sphere onto a square: an octahedron whose lower half is folded outwards.

// The cell of a table of `side`² cells that holds a direction.
uint octahedral_cell(vec3 direction, uint side) {
    vec3 on_octahedron = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    vec2 folded = (1.0 - abs(on_octahedron.zx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(on_octahedron.xz, vec2(0.0)));
    vec2 place = 0.5 * (on_octahedron.y >= 0.0 ? on_octahedron.xz : folded) + 0.5;
    uvec2 cell = min(uvec2(place * float(side)), uvec2(side - 1u));
    return cell.y * side + cell.x;
}
