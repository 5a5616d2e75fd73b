// Surface point of a sample of an edge pixel, without a ray. Include after antialias.glsl,
// sampling.glsl and primary.glsl.
PixelSurface edge_point(View view, uint pixel, EdgeSample seen, uint number, uint count) {
    vec2 corner = vec2(in_rows(pixel, view.width));
    return seen_on(view, corner + sample_3d(number + point_of(seen) * count, pixel).xy, seen.side);
}
