// Where direct light meets a surface that the camera sees. Include after quirks.glsl,
// triangles.glsl and surfaces.glsl.

// A point that takes light, and the normal of the surface there that occludes.
struct Receiver {
    vec3 position;
    vec3 normal;
};

// On a rounded surface, `position` is lifted to the smooth surface around the facet, which touches
// the planes across the normals at the corners. [Hanika 2021] Without the lift, other facets hide a
// light that is above the smooth surface's horizon, and the line between light and shadow follows
// the facets. Concave surfaces are not lifted.
Receiver receiver_at(vec3 position, uint side, vec3 shading) {
    Surface surface = surface_at(side >> 1);
    Receiver found = Receiver(position, facet_of(surface, side));
    if_any ((surface.sides & ROUNDED) != 0u) {
        Corners corners = corners_of(side >> 1);
        vec3 edge_1 = corners.p1 - corners.p0;
        vec3 edge_2 = corners.p2 - corners.p0;
        vec3 across = cross(edge_1, edge_2);
        vec3 from_p0 = position - corners.p0;
        vec2 weights = vec2(dot(cross(from_p0, edge_2), across), dot(cross(edge_1, from_p0), across)) / dot(across, across);
        float turn = (side & 1u) != 0u ? -1.0 : 1.0;
        vec3 below = max(vec3(0.0), -turn * vec3(dot(from_p0, surface.n0), dot(position - corners.p1, surface.n1), dot(position - corners.p2, surface.n2)));
        vec3 shares = max(vec3(0.0), vec3(1.0 - weights.x - weights.y, weights));
        vec3 lift = turn * (shares.x * below.x * surface.n0 + shares.y * below.y * surface.n1 + shares.z * below.z * surface.n2);
        if (lift != vec3(0.0)) found = Receiver(position + lift, shading);
    }
    return found;
}

Receiver receiver_of(PixelSurface point) { return receiver_at(point.position, point.side, point.normal); }
