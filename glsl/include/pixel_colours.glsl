// Colours of images at image points. Include after textures.glsl; the including shader also binds
// the texels `Surfaces`.

// xyz: colour of the triangle's image where the ray of an image point meets the triangle's plane;
// `point` is in pixels from the top left corner. w: positive or negative, by the side of the plane
// that the ray meets; zero in a hole.
vec4 colour_through(View view, vec2 point, uint triangle) {
    vec2 ndc = point / vec2(view.width, view.height) * 2.0 - 1.0;
    vec3 direction = view.forward + ndc.x * view.right - ndc.y * view.up;
    Surface surface = surface_at(triangle);
    float facing = dot(surface.normal, direction);
    float t = dot(surface.normal, corners_of(triangle).p0 - view.position) / facing;
    vec3 barycentric = barycentric_at(triangle, view.position + t * direction);
    vec3 colour = facing == 0.0 ? vec3(0.0) : image_at(surface.material, triangle, barycentric);
    if (HAS_CUTOUTS != 0u && is_hole(triangle, barycentric)) facing = 0.0;
    return vec4(colour, facing);
}
