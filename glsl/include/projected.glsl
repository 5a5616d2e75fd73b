// Triangles seen from the camera, around the centre of a pixel. Include after triangles.glsl.

// Edge functions of a triangle at an offset from the centre, in units of the image plane:
// `at_centre` + offset.x·`along_x` + offset.y·`along_y`, one component for each corner opposite. An
// image point is inside if none are positive or none negative. The edge functions of two triangles
// at one edge are each other's negative to the bit: no point between both is lost. [Pineda, Woop]
struct Projected {
    vec3 at_centre;
    vec3 along_x;
    vec3 along_y;
    vec3 xs;      // of the corners, on planes across the view axis, from the ray through the centre
    vec3 ys;
    vec3 depths;  // along the view axis
};

// A point relative to the camera: along the image plane's axes, from the ray through `centre`, and
// its depth.
vec3 from_centre(View view, vec2 centre, vec3 point) {
    vec3 d = point - view.position;
    float depth = dot(d, view.forward);
    vec2 place = vec2(dot(d, view.right) / dot(view.right, view.right), -dot(d, view.up) / dot(view.up, view.up));
    return vec3(place - depth * centre, depth);
}

// `centre` is a point of the image, from -1 to 1 on each axis.
Projected projected(View view, vec2 centre, Corners corners) {
    vec3 a = from_centre(view, centre, corners.p0);
    vec3 b = from_centre(view, centre, corners.p1);
    vec3 c = from_centre(view, centre, corners.p2);
    precise vec3 at_centre = vec3(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
    precise vec3 along_x = vec3(c.y * b.z - c.z * b.y, a.y * c.z - a.z * c.y, b.y * a.z - b.z * a.y);
    precise vec3 along_y = vec3(c.z * b.x - c.x * b.z, a.z * c.x - a.x * c.z, b.z * a.x - b.x * a.z);
    return Projected(at_centre, along_x, along_y, vec3(a.x, b.x, c.x), vec3(a.y, b.y, c.y), vec3(a.z, b.z, c.z));
}

// Its edge functions at an offset from the centre.
vec3 edges_at(Projected triangle, vec2 offset) {
    precise vec3 edges = triangle.at_centre + offset.x * triangle.along_x + offset.y * triangle.along_y;
    return edges;
}

// Depth of the triangle's plane where it has these edge functions.
float depth_of(Projected triangle, vec3 edges) { return dot(edges, triangle.depths) / (edges.x + edges.y + edges.z); }

// A triangle as samples compare it: its edge functions, which are positive inside if it is in front
// of the camera; and 1 / depth, which is linear on the image plane, so that no sample divides. The
// components are at the centre, and along x and y. [Blinn 1992]
struct Compared {
    vec3 at_centre;
    vec3 along_x;
    vec3 along_y;
    vec3 inverse_depth;  // along x and y, and at the centre; 0 if the triangle is seen edge-on
    bool is_back;
};

Compared compared(Projected triangle) {
    vec3 a = vec3(triangle.xs.x, triangle.ys.x, triangle.depths.x);
    vec3 b = vec3(triangle.xs.y, triangle.ys.y, triangle.depths.y);
    vec3 c = vec3(triangle.xs.z, triangle.ys.z, triangle.depths.z);
    vec3 normal = cross(b - a, c - a);
    float volume = dot(normal, a);
    float turn = volume > 0.0 ? -1.0 : 1.0;
    vec3 inverse_depth = volume == 0.0 ? vec3(0.0) : normal / volume;
    return Compared(turn * triangle.at_centre, turn * triangle.along_x, turn * triangle.along_y, inverse_depth, volume > 0.0);
}

vec3 edges_at(Compared triangle, vec2 offset) {
    precise vec3 edges = triangle.at_centre + offset.x * triangle.along_x + offset.y * triangle.along_y;
    return edges;
}

float inverse_depth_at(Compared triangle, vec2 offset) { return dot(triangle.inverse_depth, vec3(offset, 1.0)); }

// Centre of a pixel on the image plane, and the size of a pixel.
vec2 centre_of(View view, uvec2 pixel) { return (2.0 * vec2(pixel) + 1.0) / vec2(view.width, view.height) - 1.0; }
vec2 pixel_size(View view) { return 2.0 / vec2(view.width, view.height); }
