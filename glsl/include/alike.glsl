// Similarity of surfaces, to choose the pixel whose indirect light a sample takes. Include after
// records.glsl; the including shader binds the texels `Surfaces`.

// Cost of taking a pixel's surface for that of a sample: the angle between normals, the distance
// from the sample's plane in pixel widths, and a facet with another horizon. The facets are
// the geometric normals of both.
float dissimilarity(PixelSurface found, vec3 facet, PixelSurface pixel, vec3 pixel_facet) {
    vec3 apart = pixel.position - found.position;
    return 1.0 - dot(found.normal, pixel.normal) + abs(dot(apart, found.normal)) * inversesqrt(found.footprint)
         + 1e-3 * dot(apart, apart) / found.footprint + (dot(facet, pixel_facet) < FACETS_ALIKE ? 1.0 : 0.0);
}
float dissimilarity(PixelSurface found, vec3 facet, PixelSurface pixel) {
    return dissimilarity(found, facet, pixel, facing_normal(pixel.side));
}
