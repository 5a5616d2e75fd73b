// Camera rays. Include after types.glsl.

// Direction through an image point, in pixels from the top left corner; of unit length along the
// view axis.
vec3 direction_through(View view, vec2 point) {
    vec2 ndc = point / vec2(view.width, view.height) * 2.0 - 1.0;
    return view.forward + ndc.x * view.right - ndc.y * view.up;
}
