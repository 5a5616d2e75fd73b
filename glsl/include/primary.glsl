// Surfaces at camera rays. The including shader binds the scene and includes bvh.glsl.

const PixelSurface NOTHING_SEEN = PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);

// Surface at the hit of a camera ray.
PixelSurface seen_at(View view, vec3 direction, Hit hit) {
    Surface surface = surface_at(hit.triangle);
    bool back = dot(surface.normal, direction) > 0.0;
    vec3 normal = normalize(hit.barycentric.x * surface.n0 + hit.barycentric.y * surface.n1 + hit.barycentric.z * surface.n2);
    // t is the depth along the view axis, because `direction` has unit length along it.
    float footprint = view.pixel_area * hit.t * hit.t;
    return PixelSurface(hit_position(hit), 2u * hit.triangle + uint(back), back ? -normal : normal, footprint);
}

// Surface behind an image point.
PixelSurface seen_through(View view, vec2 point) {
    vec3 direction = direction_through(view, point);
    Hit hit;
    if (!trace(Ray(view.position, direction, 1e30), false, hit)) return NOTHING_SEEN;
    return seen_at(view, direction, hit);
}

// Cosine between shading and geometric normal below which a surface is curved.
const float FLAT = 0.99999;
bool is_curved(PixelSurface found) { return dot(found.normal, facing_normal(found.side)) < FLAT; }

// Intersection of a camera ray with a triangle's plane, inside the triangle or not. Traces no ray.
Hit hit_on_plane(View view, vec3 direction, uint triangle) {
    Corners corners = corners_of(triangle);
    vec3 across = cross(corners.p1 - corners.p0, corners.p2 - corners.p0);
    float t = dot(across, corners.p0 - view.position) / dot(across, direction);
    vec3 from_p0 = view.position - corners.p0 + t * direction;
    vec2 weights = vec2(dot(cross(from_p0, corners.p2 - corners.p0), across), dot(cross(corners.p1 - corners.p0, from_p0), across))
                 / dot(across, across);
    return Hit(t, triangle, vec3(1.0 - weights.x - weights.y, weights));
}

// Whether all rays through a pixel meet the triangle of a side. The four corners decide: a
// triangle is convex.
bool fills_pixel(View view, vec2 corner, uint side) {
    bool fills = true;
    for (uint i = 0u; i < 4u; ++i) {
        Hit hit = hit_on_plane(view, direction_through(view, corner + vec2(i & 1u, i >> 1)), side >> 1);
        vec3 weights = hit.barycentric;
        // NaN, and so false, if the ray is parallel to the plane.
        fills = fills && hit.t > 0.0 && min(weights.x, min(weights.y, weights.z)) >= 0.0;
    }
    return fills;
}

// Whether samples of a pixel without an edge need camera rays: if the surface is curved, if it may
// have a hole, or if the samples may see several triangles. At a concave crease the plane of one
// facet runs behind the next one, which would shadow the samples.
bool is_sampled_by_rays(View view, vec2 corner, PixelSurface found) {
    return found.side != NO_SIDE && (is_curved(found) || has_holes(found.side >> 1) || !fills_pixel(view, corner, found.side));
}

// Surface at an image point if the side is known, without a ray. Of bvh.glsl it
// needs only hit_position.
PixelSurface seen_on(View view, vec2 point, uint side) {
    vec3 direction = direction_through(view, point);
    uint triangle = side >> 1;
    Surface surface = surface_at(triangle);
    Hit hit = hit_on_plane(view, direction, triangle);
    float t = hit.t;
    vec3 normal = normalize(hit.barycentric.x * surface.n0 + hit.barycentric.y * surface.n1 + hit.barycentric.z * surface.n2);
    return PixelSurface(hit_position(hit), side, (side & 1u) != 0u ? -normal : normal, view.pixel_area * t * t);
}
