// The records of what a pixel shows. Include after antialias.glsl; the including shader binds
// WeightRanges, of pixels, and EdgeWeightRanges, of edge points.

// Range of the splat weights of a fragment: of its edge point, or else of the pixel whose indirect
// light it takes.
uvec2 weights_of(Fragment fragment, uint pixel, uvec2 size) {
    if (fragment.point != NO_POINT) return pair_at(EdgeWeightRanges, fragment.point);
    return pair_at(WeightRanges, pixel_at(size, pixel, place_of(fragment)));
}
