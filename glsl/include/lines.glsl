// Lines on the image plane of a view or a light.

// Shortens `span` of a line to where a value above zero at some end stays so.
void clip(float from, float to, inout vec2 span) {
    float crossing = from / (from - to);
    if (from < 0.0) span.x = to < 0.0 ? 2.0 : max(span.x, crossing);
    else if (to < 0.0) span.y = min(span.y, crossing);
}
