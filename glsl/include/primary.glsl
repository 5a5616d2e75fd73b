// What a camera ray sees. The including shader binds the scene and includes bvh.glsl.

// Surface behind an image point, in pixels from the top left corner.
PixelSurface seen_through(View view, vec2 point) {
    vec2 ndc = point / vec2(view.width, view.height) * 2.0 - 1.0;
    vec3 direction = view.forward + ndc.x * view.right - ndc.y * view.up;
    Hit hit;
    if (!trace(Ray(view.position, direction, 1e30), false, hit)) return PixelSurface(vec3(0.0), NO_SIDE, vec3(0.0), 0.0);
    Surface surface = surfaces[hit.triangle];
    bool back = dot(surface.normal, direction) > 0.0;
    vec3 normal = normalize(hit.barycentric.x * surface.n0 + hit.barycentric.y * surface.n1 + hit.barycentric.z * surface.n2);
    // t is the depth along the view axis, because `direction` has unit length along it.
    float footprint = view.pixel_area * hit.t * hit.t;
    return PixelSurface(hit_position(hit), 2u * hit.triangle + uint(back), back ? -normal : normal, footprint);
}
